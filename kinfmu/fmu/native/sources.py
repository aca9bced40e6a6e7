"""The C sources of a native FMU: the model, the solver, the instance, and what is generated for this FMU."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from itertools import accumulate
from pathlib import Path
from types import MappingProxyType

from kinfmu.codegen.c import compiler, emit
from kinfmu.codegen.c.text import FUNCTIONS, array, booleans, defines, function, header, string
from kinfmu.codegen.forces import STAGES, emit_c_forces, places_of_symbols, solves
from kinfmu.codegen.writer import Names, Writer, identifier
from kinfmu.errors import MissingPackageError
from kinfmu.fmu.interface import Interface, Variable
from kinfmu.fmu.slave import estimated_rates
from kinfmu.fmu.slave.estimated_rates import Rates
from kinfmu.fmu.slave.layout import UNKNOWN_ERROR
from kinfmu.plan import SolvePlan
from kinfmu.plan.efforts import LedLaws, units_in_si
from kinfmu.plan.forces import ForceSteps
from kinfmu.plan.trace import parameter_symbol
from kinfmu.plan.undetermined import distance_steps, meeting_messages
from kinfmu.solver.python.torque import dormand_prince as pair
from kinfmu.solver.python.torque import equation_of_motion, law_breaks, limits, steps

RUNTIME = Path(__file__).with_name("runtime")
_NO_VARIABLE = "0xfffffffeu"
_NOT_REAL_BIT = "0x80000000u"
HEADERS = {
    "2.0": ("fmi2TypesPlatform.h", "fmi2FunctionTypes.h", "fmi2Functions.h"),
    "3.0": ("fmi3PlatformTypes.h", "fmi3FunctionTypes.h", "fmi3Functions.h"),
}
_WORDS = {"2.0": ("Real", "Integer", "Integer"), "3.0": ("Float64", "Int64", "Int32")}
_STEP = (
    "model.c",
    "position.c",
    "pose.c",
    "trusted_step.c",
    "solver.c",
    "requested_pose.c",
    "stepping.c",
    "time_derivatives.c",
    "instance.c",
    "variables.c",
    "set_variables.c",
)  # the functions that a step calls
_HINTS = (  # in short steps, vector loads of values just stored stall, and branches are predicted well
    "#if defined(__GNUC__) && !defined(__clang__)",
    '#pragma GCC optimize("no-tree-vectorize", "no-tree-slp-vectorize", "no-if-conversion")',
    "#endif",
)
_BY_INPUTS = ("drive.c", "motion_by_inputs.c")  # what implements motion.h, of which an FMU has one or the other
_BY_EFFORTS = ("equation_of_motion.c", "limits.c", "breaks.c", "torque.c", "motion_by_efforts.c")
_HEADERS_OF = {_BY_INPUTS: "drive.h", _BY_EFFORTS: "torque.h"}
_OTHER_VERSION = {"2.0": "fmi3.c", "3.0": "fmi2.c"}


def sources(
    plan: SolvePlan,
    variables: Interface,
    version: str,
    token: str,
    forces: Mapping[str, ForceSteps] = MappingProxyType({}),
    inertia: ForceSteps | None = None,
    laws: LedLaws | None = None,
) -> dict[str, str]:
    """Return all C files and headers of the FMU by name, except the headers of FMI.

    Args:
        plan: Plan of the mechanism.
        variables: Variables of the FMU.
        version: Version of FMI, "2.0" or "3.0".
        token: Hash of the FMU's content.
        forces: Stages of the forces that are outputs, by part. Default: none.
        inertia: Steps to bias efforts and reduced inertia, if the FMU owns the motion of its drivers.
        laws: Laws over quantities with breaks, at which it restarts its integrator.

    """
    motion, other = (_BY_INPUTS, _BY_EFFORTS) if inertia is None else (_BY_EFFORTS, _BY_INPUTS)
    left_out = {_OTHER_VERSION[version], *other, _HEADERS_OF[other]}
    instance = {
        file.name: file.read_text("utf-8")
        for file in sorted(RUNTIME.iterdir())
        if file.suffix in (".c", ".h") and file.name not in left_out
    }
    if inertia is not None:
        instance["inertia.c"] = "\n".join(
            [emit_c_forces(plan, inertia, "inertia"), *array("double kf_in_si", units_in_si(plan)), ""]
        )
        counts = laws.counts if laws else ()
        instance["efforts.h"] = _efforts_header(counts)
        if laws and counts:
            instance["laws.c"] = emit_c_forces(plan, laws.steps, "laws")
        instance["dormand_prince.h"] = _dormand_prince()
    if forces:
        if any(map(solves, forces.values())):
            instance |= compiler.sources(["solutions.c"])
        instance |= {f"{stage}.c": emit_c_forces(plan, steps, stage) for stage, steps in forces.items()}
        distances = distance_steps(plan)
        if distances.results:
            messages = [string(message) for message in meeting_messages(plan, distances)]
            lines = [emit_c_forces(plan, distances, "distances"), *array("char *const kf_meeting", messages), ""]
            instance["distances.c"] = "\n".join(lines)
    tables = {"interface.h": _header(plan, variables, version, token), "interface.c": _tables(variables)}
    tables |= {"step.c": _step(version, motion), "events.c": _events(plan, owns=inertia is not None)}
    files = emit(plan) | compiler.sources(compiler.SOLVER) | instance | tables
    return dict(sorted(_prefixed(files, version).items()))


def _efforts_header(counts: Sequence[int]) -> str:
    """Return efforts.h: constants of the motion under efforts, and the number of breaks of each law over a quantity."""
    modules = (equation_of_motion, law_breaks, limits, pair, steps)
    beyond = ", ".join(map(repr, limits.BEYOND))
    lines = [
        *defines("KF_TORQUE_", modules),
        f"#define KF_TORQUE_BEYOND {{{beyond}}}",
        f"#define KF_LAWS {len(counts)}",
    ]
    if counts:
        lines.append(f"#define KF_LAW_NUMBERS {sum(counts) + 4 * len(counts)}")
        lines += array("static int kf_law_breaks", counts)
    return header("efforts", "Constants of kinfmu/solver/python/torque, and laws with breaks: generated.", lines)


def _dormand_prince() -> str:
    """Return dormand_prince.h: the coefficients of the integrator."""
    count = len(pair.C)
    lines = [
        f"#define KF_STAGES {count} /* the derivatives at the end of the step follow */",
        *array("static double kf_dp_c", pair.C),
        *array("static double kf_dp_a", [value for row in pair.A for value in (*row, *(0.0,) * (count - len(row)))]),
    ]
    for name, row in {"b": pair.B, "e3": pair.E3, "e5": pair.E5}.items():
        lines += array(f"static double kf_dp_{name}", row[:count])
    comment = "Dormand and Prince, order 8 with error estimates of orders 5 and 3: generated from a table."
    return header("dormand_prince", comment, lines)


def _step(version: str, motion: Sequence[str]) -> str:
    """Return step.c, which joins the files that a step uses, so that the compiler can inline small functions."""
    lines = ["/* The functions of set, step and get as one unit. Files included here are not compiled separately. */"]
    lines += _HINTS
    lines += [f'#include "{name}"' for name in (*_STEP[:5], *motion, *_STEP[5:], f"fmi{version[0]}.c")]
    return "\n".join(lines) + "\n"


def headers(version: str) -> dict[str, str]:
    """Return the headers of FMI, from fmpy. FMUs do not contain them: importers have their own.

    Args:
        version: Version of FMI, "2.0" or "3.0".

    Returns:
        Texts by name.

    Raises:
        MissingPackageError: If fmpy is not installed.

    """
    found = find_spec("fmpy")  # not imported: the import takes longer than compiling a file
    places = found.submodule_search_locations if found is not None else None
    try:
        return {name: Path(places[0] if places else "", "c-code", name).read_text("utf-8") for name in HEADERS[version]}
    except OSError:
        raise MissingPackageError(
            "building native FMUs needs the headers that fmpy carries; pip install fmpy"
        ) from None


def _header(plan: SolvePlan, variables: Interface, version: str, token: str) -> str:
    """Return interface.h: numbers and places of the variables."""
    references = variables.value_references()
    parts = _real_parts(variables)
    counts = {name: len(members) for name, members in parts.items()}
    states = 2 * len(plan.drivers) if "states" in parts else 0
    inputs = len(plan.drivers) + len(variables.inputs("loads")) if states else counts["inputs"]
    aliases = {"INPUTS": "STATES", "DRIVEN": "STATES", "MOVERS": "EFFORTS"} if states else {"MOVERS": "INPUTS"}
    meeting = len(distance_steps(plan).results) if any(counts[stage] for stage in STAGES) else 0
    words = _WORDS[version]
    lines = [
        "#include <stdbool.h>",
        "",
        f"#define KF_TOKEN {string(token)}",
        f"#define KF_VARIABLES {len(references)}",
        f"#define KF_REALS {sum(counts.values())} /* they come first; value references count all variables from 1 */",
        "",
        "/* Parts: variables that are computed together and are neighbours. */",
        "enum {",
        *(f"    KF_PART_{name.upper()}," for name in parts),
        "    KF_PARTS,",
        *(f"    KF_PART_{name} = KF_PART_{other}," for name, other in aliases.items()),
        "};",
        "",
        f"#define KF_STATES {states} /* of model exchange */",
        f"#define KF_INPUTS {inputs} /* whose derivatives a step can follow */",
        *(f"#define KF_STAGE_{stage.upper()} {counts[stage]}" for stage in STAGES),
        f"#define KF_LOADS {counts['loads']} /* efforts of external loads, then constants of the laws of loads */",
        f"#define KF_LOAD_INPUTS {len(variables.inputs('loads'))}",
        f"#define KF_MEETING {meeting} /* loads between points that may meet */",
        "",
        f"#define KF_STATUS {references['solver.status']}",
        f"#define KF_ITERATIONS {references['solver.iterations']}",
        f"#define KF_WORK {references.get('solver.work', _NO_VARIABLE)}",
        f"#define KF_MOST_WORK {references.get('solver.most_work', _NO_VARIABLE)}",
        f"#define KF_SOLVER_OK {references['solver.ok']}",
        f"#define KF_DRIVEN_BY_TIME {references.get('driven_by_time', _NO_VARIABLE)}",
        f"#define KF_RATES {references.get('rates', _NO_VARIABLE)}",
        *(f"#define KF_RATES_{mode.name} {int(mode)}" for mode in Rates),
        f"#define KF_MESSAGE_TEXT {references['solver.message']}",
        f"#define KF_TIME {references.get('time', '0xffffffffu /* FMI 2.0 has no such variable */')}",
        f"#define KF_UNKNOWN_ERROR {UNKNOWN_ERROR!r} /* of solver.error_q, _qd, _qdd: there is no estimate */",
        f"#define KF_JUST_AFTER {steps.JUST_AFTER!r} /* relative to the numbers from which a jump is computed */",
        *defines("KF_", [estimated_rates]),
        f"#define KF_JUMPS {len(plan.jumps)} /* of what drives over time */",
        f'#define KF_REAL_WORD "{words[0]}"',
        f'#define KF_ENUMERATION_WORD "{words[1]}"',
        f'#define KF_ITERATIONS_WORD "{words[2]}"',
        "",
        "extern const char *const kf_variable_names[KF_VARIABLES];",
        *array("static int kf_part_first", [0, *accumulate(counts.values())]),
        "extern const unsigned char kf_part_of[KF_REALS];",
        f"#define KF_NOT_REAL {_NOT_REAL_BIT}",
        "extern const unsigned kf_bit_of[KF_VARIABLES + 1]; /* 1 << kf_part_of, or KF_NOT_REAL */",
        "extern const double kf_real_starts[KF_REALS];",
        "extern const bool kf_real_is_positive[KF_REALS];",
        "extern const bool kf_driven_by_time_start;",
        "extern const int kf_rates_start;",
        "extern const double kf_start_time;",
    ]
    comment = f"Variables of the FMU of {variables.name}: generated from its mechanism, not to be edited."
    return header("interface", comment, lines)


def _tables(variables: Interface) -> str:
    """Return interface.c: names, start values and limits of the variables."""
    parts = _real_parts(variables)
    real = [variable for members in parts.values() for variable in members]
    drives = [variable.start for variable in variables.part("drive")] or [False]
    rates = [variable.start for variable in variables.part("rate_source")] or [Rates.WIRED]
    place = [number for number, members in enumerate(parts.values()) for _ in members]
    positive = [v.causality == "parameter" and v.minimum is not None and v.minimum >= 0.0 for v in real]
    lines = [
        f"/* Variables of the FMU of {variables.name}: generated from its mechanism, not to be edited. */",
        '#include "interface.h"',
        "",
        *array("char *const kf_variable_names", [string(variable.name) for variable in variables]),
        *array("unsigned char kf_part_of", place),
        *array(
            "unsigned kf_bit_of", [1 << k for k in place] + [_NOT_REAL_BIT] * (len(list(variables)) - len(real) + 1)
        ),
        *array("double kf_real_starts", [float(variable.start or 0.0) for variable in real]),
        *array("bool kf_real_is_positive", booleans(positive)),
        f"const bool kf_driven_by_time_start = {'true' if drives[0] else 'false'};",
        f"const int kf_rates_start = {int(rates[0] or 0)};",
        f"const double kf_start_time = {float(variables.experiment.start)!r};",
    ]
    return "\n".join(lines) + "\n"


def _real_parts(variables: Interface) -> dict[str, Sequence[Variable]]:
    """Return the Real variables by part; the parts of forces are empty where no force is an output."""
    parts: dict[str, Sequence[Variable]] = {
        part.name: part.variables for part in variables.parts if part.type == "Real"
    }
    return parts | {name: () for name in ("loads", *STAGES) if name not in parts}


def _events(plan: SolvePlan, *, owns: bool) -> str:
    """Return events.c: the times at which laws jump, which model exchange announces to its host.

    They are a function of the constants of the laws and of the parameters; of the efforts and laws of loads if the FMU
    owns the motion of its drivers.
    """
    signature = "void kf_jumps(const kf_model *model, const double *constants, double *jumps, double *periods)"
    writer = Writer(Names(functions=FUNCTIONS), ())
    body = [f"{line};" for line in writer.statements([node for jump in plan.jumps for node in jump])]
    for k, (at, period) in enumerate(plan.jumps):
        body += [f"jumps[{k}] = {writer.expression(at)};", f"periods[{k}] = {writer.expression(period)};"]
    if owns:
        places = {name: place.replace("efforts", "constants") for name, place in places_of_symbols(plan).items()}
    else:
        places = {constant.name: f"constants[{k}]" for k, constant in enumerate(plan.law_constants)}
    places |= {parameter_symbol(one.name): f"model->parameters[{k}]" for k, one in enumerate(plan.parameters)}
    used = {node.name for node in writer.used if node.op == "symbol"}
    loads = [f"{identifier(name)} = {place};" for name, place in places.items() if name in used]
    lines = [
        f"/* Jumps of the laws of {plan.mechanism.name}: generated from its mechanism, not to be edited. */",
        '#include "instance.h"',
        "",
        *function(signature, [*loads, *body]),
    ]
    return "\n".join(lines).rstrip("\n") + "\n"


def _prefixed(sources: Mapping[str, str], version: str) -> dict[str, str]:
    """Return the C files, each including kf_names.h first, and kf_names.h.

    It gives the functions of one FMU unique names, so that several can be linked into one program: FMI puts
    FMI2_FUNCTION_PREFIX or FMI3_FUNCTION_PREFIX before its functions, this header before every other name.
    """
    names = sorted({name for text in sources.values() for name in re.findall(r"\bkf_\w+", text)})
    prefix = f"FMI{version[0]}_FUNCTION_PREFIX"
    lines = [
        f"#ifdef {prefix}",
        "#define KF_PASTE(a, b) a##b",
        "#define KF_JOIN(a, b) KF_PASTE(a, b)",
        *(f"#define {name} KF_JOIN({prefix}, {name})" for name in names),
        "#endif",
    ]
    comment = f"With {prefix} every name begins with it, so that several FMUs can be linked into one program."
    files = {name: f'#include "kf_names.h"\n{text}' for name, text in sources.items()}
    return files | {"kf_names.h": header("names", comment, lines)}
