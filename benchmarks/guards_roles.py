"""Guards of what a stranger's file may set, read, name and draw."""

from __future__ import annotations

from benchmarks.guard import Guard

ROLES = "tests/unit/test_field_roles.py"

ROLES_AND_READERS: dict[str, Guard] = {
    "roles of values": Guard(
        "seals.cli.hydra_app",
        "        if source:\n            refuse_values(",
        "        if False:\n            refuse_values(",
        ROLES,
        "sets_data_only or card",
    ),
    "roles of objects in the scene": Guard(
        "seals.config.foreign_values",
        'elif name == "objects" and isinstance(node, DictConfig):',
        "elif False:",
        ROLES,
        "folder_of_configuration",
    ),
    "robots elsewhere": Guard(
        "seals.config.foreign_values",
        "if str(value) != _installed(node).get(name):",
        "if False:",
        ROLES,
        "folder_of_configuration",
    ),
    "names of what is installed": Guard(
        "seals.config.foreign_values",
        "        and _SHIPPED.fullmatch(one) is not None\n",
        "",
        ROLES,
        "installed_things",
    ),
    "names as paths": Guard(
        "seals.file_names", "        or _REFUSED & set(text)\n", "", ROLES, "no_path"
    ),
    "names of instances": Guard(
        "seals.run.build", "if not _NAME.fullmatch(str(name)):", "if False:", ROLES, "instances"
    ),
}
