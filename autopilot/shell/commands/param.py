"""param: shows and changes parameters (PX4: systemcmds/param).

A parameter is shown as `x + l NAME [used index,index] : value`: x is in use on this vehicle, + differs from the
default, * was set and is not saved yet, l can't be changed, which PX4's simulation says of none. Whoever sets,
compares or touches one marks it as in use (param_find), so that ground stations get it in their list from then on.
"""

import errno
from collections.abc import Sequence

from sitl_emu.autopilot.parameters import Parameters, Value
from sitl_emu.autopilot.parameters import file as parameter_file
from sitl_emu.autopilot.shell.command import (
    FAILURE,
    SUCCESS,
    Output,
    Vehicle,
    error,
    info,
    integer,
    number,
    usage,
    warning,
)
from sitl_emu.autopilot.storage import storage

LEGEND = "Symbols: x = used, + = saved, * = unsaved, l = locked\n"
OF_VEHICLE = ("RC", "TC_", "CAL_")
OF_SETUP = ("SYS_AUTOSTART", "SYS_AUTOCONFIG", "SENS_DPRES_OFF", "MAV_TYPE")
"""What an airframe's file does not hold (do_show_print_for_airframe)."""
FLOAT_EPSILON = 1e-7
INT32 = 1 << 31
COMMANDS = (
    ("show", "values; -a all, -c changed, -l locked, -q NAME the value alone; a * may end the name"),
    ("show-for-airframe", "changed values as lines of an airframe's file"),
    ("status", "how many there are"),
    ("set", "NAME VALUE [fail]"),
    ("set-default", "[-s] NAME VALUE: what the parameter is while nobody sets it"),
    ("compare", "[-s] NAME VALUE...: succeed if it is one of these"),
    ("greater", "[-s] NAME VALUE: succeed if it is more"),
    ("touch", "NAME...: mark as used"),
    ("reset", "NAME...: back to the default; a * may end a name"),
    ("reset_all", "[EXCEPT...]: all back to their defaults"),
    ("index", "NUMBER: the parameter with this index"),
    ("index_used", "NUMBER: the same among those in use"),
    ("find", "NAME: its index"),
    ("save", "[FILE]: write changed values to storage, or to a file, now"),
    ("load", "[FILE]: take over a file's values alone"),
    ("import", "[FILE]: take over a file's values"),
)


def main(vehicle: Vehicle, arguments: Sequence[str]) -> Output:
    """`param COMMAND ...`."""
    parameters = vehicle.parameters
    command, *words = arguments or [""]
    if command == "show":
        return (yield from _show(parameters, words))
    if command == "show-for-airframe":
        return (yield from _show_for_airframe(parameters))
    if command == "status":
        return (yield from _status(parameters))
    if command == "set":
        return (yield from _set(parameters, words))
    if command == "set-default":
        return (yield from _set_default(parameters, words))
    if command in ("compare", "greater"):
        return (yield from _compare(parameters, command, words))
    if command in ("index", "index_used"):
        return (yield from _show_index(parameters, words, used=command == "index_used"))
    if command == "find":
        return (yield from _find(parameters, words))
    if command == "touch":
        return (yield from _touch(parameters, words))
    if command == "reset":
        return (yield from _reset(parameters, words))
    if command == "reset_all":
        parameters.reset(lambda name: not any(_matches(pattern, name) for pattern in words))
        return SUCCESS
    if command == "save" and not words:
        return SUCCESS if vehicle.parameter_storage.save() else FAILURE
    if command == "save":
        return (yield from _export(vehicle, words[0]))
    if command in ("load", "import"):
        return (yield from _take(vehicle, command, words[0] if words else storage.PARAMETERS))
    yield usage("param", COMMANDS)
    return FAILURE


def _show(parameters: Parameters, words: list[str]) -> Output:
    flag = words[0] if words else ""
    if flag == "-q" and len(words) > 1:
        if words[1] not in parameters:
            return FAILURE
        yield _value(parameters, words[1]) + "\n"
        return SUCCESS
    if flag == "-q":
        yield usage("param", COMMANDS)
        return FAILURE
    yield LEGEND
    if flag == "-l":
        return SUCCESS
    if flag == "-a":
        names, pattern = list(parameters.everything), None
    elif flag == "-c":
        names, pattern = [name for name in parameters.everything if name in parameters.changed()], words[1:2]
    else:
        names, pattern = list(parameters), words[:1]
    for name in names:
        if not pattern or _matches(pattern[0].upper(), name):
            yield _line(parameters, name)
    used, total = len(parameters.announced), len(parameters.everything)
    if flag == "-a":
        yield f"\n {total} parameters total, {used} used.\n"
    else:
        yield f"\n {used}/{total} parameters used.\n"
    return SUCCESS


def _show_for_airframe(parameters: Parameters) -> Output:
    for name in parameters.changed():
        of_vehicle = name.startswith(OF_VEHICLE) or name in OF_SETUP or parameters.row(name).get("volatile")
        if name in parameters.index and not of_vehicle:
            yield f"param set-default {name} {_value(parameters, name)}\n"
    airframe = int(parameters["SYS_AUTOSTART"])
    if airframe:
        yield f"# Make sure to add all params from the current airframe (ID={airframe}) as well\n"
    return SUCCESS


def _status(parameters: Parameters) -> Output:
    used, total, changed = len(parameters.announced), len(parameters.everything), len(parameters.changed())
    names = parameters.everything
    custom = sum(parameters.default(name) != parameters.typed(name, parameters.row(name)["default"]) for name in names)
    yield info("parameters", f"summary: {used}/{total} (used/total)")
    yield info("parameters", "file: parameters.bson")
    yield info("parameters", "backup file: parameters_backup.bson")
    yield info("parameters", f"storage array: {changed}/{total} elements ({_bytes(changed)} bytes total)")
    counts = f"{custom}/{total} elements ({_bytes(custom)} bytes total)"
    yield info("parameters", f"storage array (custom defaults): {counts}")
    yield info("parameters", "auto save: on")
    return SUCCESS


def _bytes(count: int) -> int:
    """Of the slots for so many values: there are 32, and 4 more whenever they do not suffice (DynamicSparseLayer.h)."""
    return 8 * (32 + 4 * max(0, -(-(count - 32) // 4)))


def _set(parameters: Parameters, words: list[str]) -> Output:
    if len(words) < 2:
        yield error("param", f"not enough arguments.\nTry 'param set {words[0] if words else 'PARAM_NAME'} 3 [fail]'")
        return FAILURE
    name = words[0]
    if name not in parameters:
        yield error("param", f"Parameter {name} not found.")
        return FAILURE if words[2:3] == ["fail"] else SUCCESS
    parameters.use((name,))
    value = _parsed(parameters, name, words[1])
    if value != parameters.told(name):
        before, symbol = _value(parameters, name), _changed_symbol(parameters, name)
        parameters.set(name, value)
        yield f"{symbol} {name}: curr: {before} -> new: {_value(parameters, name)}\n"
    return SUCCESS


def _set_default(parameters: Parameters, words: list[str]) -> Output:
    silent = words[:1] == ["-s"] and len(words) > 2
    if not silent and len(words) != 2:
        name = words[0] if words else "PARAM_NAME"
        yield error("param", f"not enough arguments.\nTry 'param set-default {name} 3'")
        return FAILURE
    name, text = words[1:3] if silent else words
    if name not in parameters:
        if silent:
            return FAILURE
        yield error("param", f"Parameter {name} not found.")
        return -1
    parameters.use((name,))
    parameters.set_default(name, _parsed(parameters, name, text))
    return SUCCESS


def _compare(parameters: Parameters, command: str, words: list[str]) -> Output:
    silent = words[:1] == ["-s"]
    name, *values = words[1 if silent else 0 :] or [""]
    if not values:
        yield error("param", f"not enough arguments.\nTry 'param {command} {name or 'PARAM_NAME'} 3'")
        return FAILURE
    if name not in parameters:
        if not silent:
            yield error("param", f"Parameter {name} not found")
        return FAILURE
    parameters.use((name,))
    value = parameters.told(name)
    others = [_parsed(parameters, name, text) for text in values]
    if command == "greater":
        return SUCCESS if any(value > other for other in others) else FAILURE
    return SUCCESS if any(abs(value - other) < FLOAT_EPSILON for other in others) else FAILURE


def _show_index(parameters: Parameters, words: list[str], *, used: bool) -> Output:
    if not words:
        yield error("param", "no index provided")
        return FAILURE
    names = parameters.announced if used else parameters.everything
    index = integer(words[0])
    if not 0 <= index < len(names):
        yield error("param", f"param not found for index {index & 0xFFFFFFFF}")
        return FAILURE
    yield f"index {index}: {_line(parameters, names[index])}"
    return SUCCESS


def _find(parameters: Parameters, words: list[str]) -> Output:
    if not words:
        yield error("param", "not enough arguments.\nTry 'param find PARAM_NAME'")
        return FAILURE
    if words[0] not in parameters:
        yield error("param", f"Parameter {words[0]} not found")
        return FAILURE
    yield f"Found param {words[0]} at index {parameters.everything.index(words[0])}\n"
    return SUCCESS


def _touch(parameters: Parameters, words: list[str]) -> Output:
    if not words:
        yield error("param", "not enough arguments.")
        return FAILURE
    for name in words:
        if name in parameters:
            parameters.use((name,))
        else:
            yield error("param", f"param {name} not found")
    return SUCCESS


def _reset(parameters: Parameters, words: list[str]) -> Output:
    if not words:
        yield error("param", "not enough arguments (use 'param reset_all' to reset all).")
        return FAILURE
    parameters.reset(lambda name: any(_matches(pattern, name) for pattern in words))
    return SUCCESS


def _export(vehicle: Vehicle, name: str) -> Output:
    try:
        vehicle.parameter_storage.export(name)
    except (OSError, ValueError):
        yield error("param", f"exporting to '{name}' failed (-1)")
        return FAILURE
    return SUCCESS


def _take(vehicle: Vehicle, command: str, name: str) -> Output:
    """`load` forgets what was set before; `import` does not (do_load, do_import)."""
    try:
        values, whole = vehicle.parameter_storage.take_from(name, reset=command == "load")
    except (OSError, ValueError) as trouble:
        yield error("param", f"open '{name}' failed ({getattr(trouble, 'errno', None) or errno.EINVAL})")
        return FAILURE
    if command == "import":
        yield info("param", f"importing from '{name}'")
    for unknown in [each for each in values if each not in vehicle.parameters]:
        yield warning("parameters", f"ignoring unrecognised parameter '{unknown}'")
    if not whole:
        yield error("param", f"importing from '{name}' failed (-1)")
        return FAILURE
    floats = sum(isinstance(value, float) for value in values.values())
    size = len(parameter_file.encode(values))
    counts = f"(INT32:{len(values) - floats}, FLOAT:{floats})"
    yield info("parameters", f"BSON document size {size} bytes, decoded {size} bytes {counts}")
    return SUCCESS


def _line(parameters: Parameters, name: str) -> str:
    used_index = parameters.index.get(name, -1)
    used = " " if used_index < 0 else "x"
    position = f"[{used_index},{parameters.everything.index(name)}]"
    return f"{used} {_changed_symbol(parameters, name)}   {name} {position} : {_value(parameters, name)}\n"


def _changed_symbol(parameters: Parameters, name: str) -> str:
    if name in parameters.unsaved:
        return "*"
    return " " if parameters.told(name) == parameters.default(name) else "+"


def _value(parameters: Parameters, name: str) -> str:
    value = parameters.told(name)
    return f"{value:.4f}" if parameters.is_float(name) else str(int(value))


def _parsed(parameters: Parameters, name: str, text: str) -> Value:
    return parameters.typed(name, number(text) if parameters.is_float(name) else _int32(integer(text)))


def _int32(value: int) -> int:
    return (value + INT32) % (2 * INT32) - INT32


def _matches(pattern: str, name: str) -> bool:
    """Whether a name is what a pattern says; a * at its end stands for any rest. Only `show` takes small letters."""
    return name.startswith(pattern[:-1]) if pattern.endswith("*") else name == pattern
