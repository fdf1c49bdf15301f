"""``seals completion``: completion of verbs, groups and options in the shell."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from seals import registry
from seals.cli.options import keys_of
from seals.cli.words import names_of
from seals.config.roots import VERBS as ROOTS
from seals.config.roots import recipe_groups, roots_choosing
from seals.errors import ConfigError, suggestion

SHELLS = ("bash", "zsh", "fish")
_ALWAYS = ("--help", "--version")
_HYDRA = ("run", "compare", "diagnose", "calibrate", "teleop", "autopilot", "view", "train")
_FLAGS = ("--cfg", "--multirun")
_GROUPS_OF = ("run", "compare", "teleop", "autopilot", "view")
"""Verbs that compose a whole run."""
_OWN = {
    "new": ("robot", "datasheet", "effect", "sensor"),
    "completion": SHELLS,
    "validate": ("water",),
}


def completion(arguments: list[str]) -> int:
    """Print the completion script of a shell; it holds the names that are installed now."""
    shell = arguments[0] if arguments else ""
    if shell not in SHELLS or len(arguments) != 1:
        hint = suggestion(shell, SHELLS, label="Give one of")
        raise ConfigError(f"the shell '{' '.join(arguments)}' is not supported.\n{hint}")
    print({"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](words_of_verbs()))
    return 0


def words_of_verbs() -> dict[str, list[str]]:
    """Return the words that may follow each verb: flags, keys, and ``group=option``.

    Example:
        >>> "robot=ball" in words_of_verbs()["run"]
        True
    """
    from seals.cli.main import VERBS
    from seals.cli.new import OPTIONS

    options = {kind: registry.names(kind) for kind in registry.GROUPS if kind != "conf"}
    options["robot"] = [*options["robot"], *options.pop("animal")]
    for group, paths in recipe_groups().items():
        options[group] = [*options.get(group, []), *(path.stem for path in paths)]
    kinds = list(dict.fromkeys([*registry.GROUPS, *options]))
    found = {}
    for verb in VERBS:
        words = [*_OWN.get(verb, ())]
        if verb in ("list", "describe"):
            words += kinds
        if verb == "describe":
            words += [name for names in options.values() for name in names]
        if verb == "new":
            words += dict.fromkeys(f"{option}=" for many in OPTIONS.values() for option in many)
        takes = VERBS[verb].takes
        words += [name for key in takes for name in names_of(key)]
        if verb == "check":
            words += [f"robot={name}" for name in options["robot"]]
        for group, names in options.items():
            if verb in (roots_choosing(group) or _GROUPS_OF):
                words += [f"{group}={name}" for name in names]
        words += [*_keys(verb)] if verb in ROOTS else []
        words += [*(_FLAGS if verb in _HYDRA else ()), *_ALWAYS]
        found[verb] = list(dict.fromkeys(words))
    return found


def _notes_of() -> dict[str, str]:
    """Return what is told beside a key: allowed values with their unit, and the default.

    Example:
        >>> _notes_of()["run time.step="]
        '1e-05 to 0.1 s, default 0.004'
    """
    every = ((verb, key) for verb in ROOTS for key in keys_of(verb))
    return {f"{verb} {key.name}=": key.facts for verb, key in every if not key.choices}


def _keys(verb: str) -> Iterator[str]:
    """Yield the keys of a verb, those of few names with each."""
    for key in keys_of(verb):
        if not key.name.endswith(".KEY"):
            yield from (f"{key.name}={name}" for name in key.choices or ("",))


def _bash(words: Mapping[str, list[str]]) -> str:
    cases = "\n".join(f'    {verb}) words="{" ".join(row)}" ;;' for verb, row in words.items())
    told = " ".join(f"['{key}']='{note}'" for key, note in _notes_of().items())
    # the shell takes "=" for the end of a word: what it knows already is cut off the answers
    return f"""declare -A _seals_notes=({told})
_seals() {{
  local line="${{COMP_LINE:0:$COMP_POINT}}" cur words verb="${{COMP_WORDS[1]}}"
  cur="${{line##*[[:space:]]}}"
  if [ "$COMP_CWORD" -le 1 ]; then
    COMPREPLY=($(compgen -W "{" ".join([*words, *_ALWAYS])}" -- "$cur"))
    return
  fi
  case "$verb" in
{cases}
    *) return ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$cur"))
  if [ "${{COMP_TYPE:-0}}" = 63 ] && [ "${{#COMPREPLY[@]}}" -gt 1 ]; then
    local k note
    for k in "${{!COMPREPLY[@]}}"; do
      note="${{_seals_notes[$verb ${{COMPREPLY[$k]}}]:-}}"
      COMPREPLY[$k]="${{COMPREPLY[$k]}}${{note:+  ($note)}}"
    done
  fi
  case "$cur" in
    *=*) COMPREPLY=("${{COMPREPLY[@]#"${{cur%%=*}}="}}") ;;
  esac
  if [ "${{#COMPREPLY[@]}}" -eq 0 ]; then
    compopt -o default 2>/dev/null
  elif [ "${{#COMPREPLY[@]}}" -eq 1 ]; then
    case "${{COMPREPLY[0]}}" in *=) compopt -o nospace 2>/dev/null ;; esac
  fi
}}
complete -F _seals seals"""


def _zsh(words: Mapping[str, list[str]]) -> str:
    cases = "\n".join(f"    {verb}) choices=({' '.join(row)}) ;;" for verb, row in words.items())
    told = " ".join(f"'{key}' '{note}'" for key, note in _notes_of().items())
    return f"""#compdef seals
typeset -A _seals_notes=({told})
_seals() {{
  local -a choices shown
  if (( CURRENT == 2 )); then
    choices=({" ".join([*words, *_ALWAYS])})
    compadd -- $choices
    return
  fi
  case "$words[2]" in
{cases}
  esac
  for word in $choices; do shown+=("$word  $_seals_notes[$words[2] $word]"); done
  compadd -l -d shown -- $choices || _files
}}
compdef _seals seals"""


def _fish(words: Mapping[str, list[str]]) -> str:
    from seals.cli.main import VERBS

    told = _notes_of()
    lines = ["complete -c seals -n __fish_use_subcommand -a --version"]
    for verb, row in words.items():
        summary = VERBS[verb].summary.replace("'", "")
        lines.append(f"complete -c seals -f -n __fish_use_subcommand -a {verb} -d '{summary}'")
        seen = f"'__fish_seen_subcommand_from {verb}'"
        plain = [word for word in row if f"{verb} {word}" not in told]
        lines.append(f"complete -c seals -n {seen} -a '{' '.join(plain)}'")
        noted = {word: told[f"{verb} {word}"] for word in row if f"{verb} {word}" in told}
        lines += [f"complete -c seals -n {seen} -a '{w}' -d '{note}'" for w, note in noted.items()]
    return "\n".join(lines)
