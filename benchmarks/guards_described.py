"""Guards for descriptive files: vehicles, motors, answers of a diagnosis, models, edited texts."""

from __future__ import annotations

from benchmarks.guard import FOUND, Guard

ODD, TRIAL = "tests/unit/test_hostile_descriptions.py", "tests/unit/test_isolated_reading.py"
COUNTS, MODELS = "tests/unit/test_hostile_counts.py", "tests/unit/test_answer_models.py"
_MOTORS, _SHEET = "seals.logs.motor_curve", "seals.scaffold.datasheet"
_FORM, _EDIT = "seals.sysid.validation.answer", "seals.robot.yaml_edit"
_MODEL = "seals.config.overlay"

TERMINAL = "tests/unit/test_terminal.py"
_SHEETS, PLUGINS = "tests/unit/test_hostile_sheets.py", "tests/unit/test_hostile_plugins.py"
_KINDS = "seals.logs.check_meta"
DESCRIPTIONS: dict[str, Guard] = {
    "kinds of a data sheet": Guard(
        "seals.run.equipment_metadata",
        "    if wrong:\n",
        "    if False:\n",
        _SHEETS,
        "odd_data_sheet",
    ),
    "lookups of a data sheet": Guard(
        "seals.run.equipment_metadata",
        "    refuse_references(sheet, where=str(place))\n",
        "",
        _SHEETS,
        "odd_data_sheet",
    ),
    "a data sheet that cannot be read": Guard(
        "seals.run.equipment_metadata",
        "if not os.path.lexists(place):",
        "if not place.is_file():",
        _SHEETS,
        "ordinary_file",
    ),
    "length of a turn": Guard(
        _KINDS,
        "not abs(sum(x * x for x in found) - 1.0) < _UNIT",
        "False",
        _SHEETS,
        "odd_data_sheet",
    ),
    "least of a number": Guard(
        _KINDS,
        "_Level = Annotated[float, Within(0.0, math.inf)]",
        "_Level = float",
        _SHEETS,
        "odd_data_sheet",
    ),
    "weight of healthy flights": Guard(
        "seals.sysid.healthy_flights.balance",
        "if vehicle.environment.gravity == 0.0:",
        "if False:",
        _SHEETS,
        "healthy",
    ),
    "confidence of a model": Guard(
        "seals.config.overlay",
        '    _section(provenance.get("confidence"), f"{where} provenance.confidence")\n',
        "",
        _SHEETS,
        "confidence",
    ),
    "names in a chart of verify": Guard(
        "seals.sysid.validation.drawing",
        'title = printable(f"{found.overlay.name} on {ablation.name}: {words}")',
        'title = f"{found.overlay.name} on {ablation.name}: {words}"',
        _SHEETS,
        "drawn_without",
    ),
    "logs of a reader": Guard(
        "seals.logs.reader", "    if odd:\n", "    if False:\n", PLUGINS, "returns_logs"
    ),
    "signs that steer a terminal": Guard(
        "seals.cli.main", "with plain_streams():", "if True:", TERMINAL, "columns or refusal"
    ),
    "lines of a table": Guard(
        "seals.text_table", "tuple(map(printable, row))", "row", TERMINAL, "table_of_runs"
    ),
    "signs of a check": Guard(
        "seals.cli.check",
        "Text(printable(finding.subject))",
        "Text(finding.subject)",
        TERMINAL,
        "check",
    ),
    "markup of a check": Guard("seals.cli.check", "        markup=False,\n", "", TERMINAL, "check"),
    "signs of a name of a run": Guard(
        "seals.file_names", "        or not text.isprintable()\n", "", TERMINAL, "name_of_a_run"
    ),
    "motors are a mapping": Guard(
        _MOTORS,
        'read(dict[str, Any] | None, entry, where="motors", error=LogError) or {}',
        "entry or {}",
        ODD,
        "motor_curves",
    ),
    "numbers of motors": Guard(
        _MOTORS,
        "points: Sequence[tuple[float, float]] = ()",
        "points: Any = ()",
        ODD,
        "motor_curves",
    ),
    "speeds of rotors": Guard(
        _MOTORS,
        "if not np.all((full > 0.0) & np.isfinite(full)):",
        "if False:",
        ODD,
        "odd_rotors",
    ),
    "kind of motor commands": Guard(
        _MOTORS,
        "    if stated:\n        refuse",
        "    if False:\n        refuse",
        ODD,
        "kind_of_commands",
    ),
    "flight in a data sheet": Guard(
        _SHEET, "printable(log.name)", "log.name", ODD, "writes_no_entry"
    ),
    "robot in a data sheet": Guard(
        _SHEET, 'printable(str(vehicle["name"]))', 'vehicle["name"]', ODD, "writes_no_entry"
    ),
    "motors in a data sheet": Guard(
        _SHEET, "vars(motor_curve(stated)).items()", "stated.items()", ODD, "no_other_entry"
    ),
    "sections of metadata": Guard(
        "seals.logs.check_meta", "list(_misshapen(log.meta))", "[]", ODD, "sections"
    ),
    "vehicle of a log": Guard(
        "seals.sysid.data.vehicle",
        "except (AttributeError, LookupError, TypeError, ValueError, ArithmeticError) as cause:",
        "except ZeroDivisionError as cause:",
        ODD,
        "description_of_a_vehicle",
    ),
    "entries of an answer": Guard(
        "seals.sysid.validation.answer",
        'answer = read(Answer, raw, where=f"{path} is damaged:", extra=True)',
        "answer = raw",
        ODD,
        "odd_answer",
    ),
    "battery of a log": Guard(_MOTORS, "if not good.any():", "if False:", ODD, "without_a_voltage"),
    "full voltage of a vehicle": Guard(
        "seals.sysid.data.vehicle",
        "Annotated[float, Within(0.0, 1e4, above=True)] | None",
        "Any",
        ODD,
        "full_voltage",
    ),
    "bounds of counts": Guard(
        "seals.schema",
        "if span is not None and isinstance(value, int) and not span[0] <= value <= span[1]:",
        "if False:",
        COUNTS,
        "has_bounds",
    ),
    "jobs of a sweep": Guard(
        "seals.sweep.watch",
        "itertools.islice(o.sweep_string_iterator(), most)",
        "o.sweep_string_iterator()",
        COUNTS,
        "counted_before and 5000000",
    ),
    "processes of a diagnosis": Guard(
        "seals.sysid.report.application",
        """    check_fields(DiagnoseSettings, {"processes": processes}, where="")\n""",
        "",
        COUNTS,
        "processes_of",
    ),
    "layers of a network": Guard(
        "seals.learn.networks",
        "if len(hidden) > _MOST_LAYERS or not sound:",
        "if False:",
        COUNTS,
        "layers_of",
        "torchrl",
    ),
    "size of a basin": Guard(
        "seals.plugins.fluids.tank.fluid",
        "        refuse_large(math.prod(basin.counts), basin.boundary, settings.most)\n",
        "",
        COUNTS,
        "too_large and basin",
    ),
    "size of a window": Guard(
        "seals.plugins.fluids.moving_domain.fluid",
        "        refuse_large(math.prod(box.counts), box.boundary, settings.most)\n",
        "",
        COUNTS,
        "too_large and window",
    ),
    "size of an answer": Guard(
        _FORM, "Within(0, 32)", "Within(0, 1e9)", ODD, "odd_answer and hundreds"
    ),
    "confidence in an answer": Guard(
        _FORM,
        "confidence: _Number = 0.0",
        "confidence: Any = 0.0",
        ODD,
        "odd_answer and confidence",
    ),
    "nuisances of an answer": Guard(
        _FORM,
        "nuisance: _Table[_Number]",
        "nuisance: Any",
        ODD,
        "odd_answer and nuisance",
    ),
    "largest number of an answer": Guard(
        _FORM, "Within(-1e30, 1e30)", "Within(-1e300, 1e300)", ODD, "odd_answer and beyond"
    ),
    "verdict of an answer": Guard(
        "seals.sysid.validation.answer",
        "answer.verdict not in (*_GIVING, *_REFUSED)",
        "False",
        ODD,
        "without_an_effect",
    ),
    "models of an answer": Guard(
        _FORM, "models: _Table[AnswerModel] | None", "models: Any", MODELS, "odd_model"
    ),
    "entries of a model in an answer": Guard(
        _FORM, "Within(0, 1024)", "Within(0, 1e9)", MODELS, "odd_model and many"
    ),
    "references in an answer": Guard(
        "seals.sysid.validation.writing",
        "    refuse_references(plain(found), where=str(finding.file))\n",
        "",
        MODELS,
        "odd_model and reference",
    ),
    "names of an answer": Guard(
        "seals.sysid.validation.writing",
        "refuse_unlisted(",
        "(",
        MODELS,
        "effect_that_is_none",
    ),
    "paths in an answer": Guard(
        "seals.sysid.validation.application",
        "if role is not Role.data and getattr(part, name) != getattr(kind(), name):",
        "if False:",
        MODELS,
        "sets_no_path",
    ),
    "numbers of an answer": Guard(
        _FORM, "_Number = Annotated[float, Within(-1e30, 1e30)]", "_Number = Any", ODD, "odd_answer"
    ),
    "moments of an answer": Guard(
        _FORM,
        "start: Moment | None\n    end: Moment | None\n",
        "start: Any\n    end: Any\n",
        ODD,
        "odd_answer",
    ),
    "links of a model": Guard(
        _MODEL, "links: tuple[str, ...] | None = None", "links: Any = None", ODD, "odd_model"
    ),
    "speeds of a model": Guard(
        _MODEL, "speeds: tuple[float, ...] = ()", "speeds: Any = ()", ODD, "odd_model"
    ),
    "file of a model": Guard(
        "seals.sysid.validation.application",
        "return bool(file) and load_overlay(Path(file)) == dict(model)",
        "return bool(file)",
        ODD,
        "no_file_but_its_own",
    ),
    "checksum of a log": Guard(
        "seals.sysid.validation.answer",
        "read_bytes(table)",
        "table.read_bytes()",
        ODD,
        "table_of_holes",
    ),
    "aliases of a number": Guard(
        _EDIT,
        "if len(seen) != len({id(one) for one in (node, *numbers)}):",
        "if False:",
        ODD,
        "cannot_be_replaced",
    ),
    "mapping of a new entry": Guard(
        _EDIT,
        'if _kind(above) != "mapping" or not (above.value or above.flow_style):',
        "if False:",
        ODD,
        "no_entry_is_added",
    ),
    "signs of a message": Guard(
        "seals.cli.main", "printable(lines[0])", "lines[0]", ODD, "terminal"
    ),
    "memory of a trial": Guard(
        "seals.isolated_reading",
        "MEMORY + UNPACKED * size",
        "1 << 40",
        TRIAL,
        "_swell",
    ),
    "channels of sensors": Guard(
        "seals.logs.check_meta",
        '(*given, ("sensors.channels", Mapping[str, _Part], channels))',
        "given",
        FOUND,
        "channels_of_another_kind",
    ),
    "noise of a joined channel": Guard(
        "seals.sysid.data.join",
        'if isinstance(entry.get("sigma"), int | float)',
        "",
        FOUND,
        "states_no_noise",
    ),
    "list of rotors": Guard(
        "seals.logs.check_motion",
        "listed = stated if isinstance(stated, list | tuple) else ()",
        "listed = stated or []",
        FOUND,
        "rotors_that_are",
    ),
    "moment without thrust": Guard(
        "seals.scaffold.plug_ins",
        'if "torque" in values and "thrust" in values:',
        'if "torque" in values:',
        FOUND,
        "states_no_thrust",
    ),
    "types of tensors": Guard(
        "seals.learn.tensor_file", "TypeError, AttributeError)", "TypeError)", FOUND, "hostile_demo"
    ),
    "names of many columns": Guard(
        "seals.logs.table",
        "column = table.column(place)",
        "column = table.column(table.column_names.index(name))",
        COUNTS,
        "many_columns",
    ),
    "steps of an experiment": Guard(
        "seals.sysid.experiment_design.experiment",
        "if not length <= MOST_ROWS * found.step:",
        "if False:",
        FOUND,
        "manoeuvre",
    ),
    "twins that diverge": Guard(
        "seals.batch.tree",
        "except np.linalg.LinAlgError:",
        "except KeyError:",
        FOUND,
        "twin_that_diverges",
    ),
    "robot without inertia": Guard(
        "seals.coupling.body",
        "except np.linalg.LinAlgError as cause:",
        "except KeyError as cause:",
        FOUND,
        "without_inertia",
    ),
}
"""Every one of them by name."""
