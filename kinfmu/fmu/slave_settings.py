"""The settings of a slave: inputs and parameters, checked when they are set. The FMU has a copy: see slave.py."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pythonfmu.enums import Fmi2Status

from kinfmu.fmu.estimated_rates import LARGEST, Rates
from kinfmu.fmu.slave_outputs import SlaveOutputs


class SlaveSettings(SlaveOutputs):
    """The setters of a slave; a refused value is logged, and the next doStep is Discard."""

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        inputs = self._inputs
        if (
            len(vrs) == 1 and vrs[0] == 1 and not (self._driven_by_time or self._refused)
        ):  # the value of the only driver
            value = values[0]
            if -LARGEST <= value <= LARGEST:
                if value != inputs[0]:
                    inputs[0] = value
                    self._pose = self._shown = self._motion = None
                elif not self._touched:
                    self._shown = self._motion = None
                self._touched = True
                return
        for vr, value in zip(vrs, values):  # noqa: B905  # the host's lists are equally long
            k = vr - 1
            if not (0 <= k < len(inputs) and -LARGEST <= value <= LARGEST):  # inputs come first
                self._set_other_real(vr, value)
                continue
            if value != inputs[k]:
                inputs[k] = value
                self._shown = self._motion = None
                if k % 3 == 0:
                    self._pose = None
                elif value != 0.0 and self._rates == Rates.AUTO:
                    self._wired.add(k)
            if self._refused:
                self._refused.pop(self._references.name(vr), None)
        if not self._touched:  # from here the rates are those at the current time, not at the commit
            self._touched = True
            self._shown = self._motion = None

    def _set_other_real(self, vr: int, value: float) -> None:
        """Set a parameter, which is rare, or refuse a value."""
        part, place = self._references.real(vr)
        kind = "" if part is None else self.layout.parts[part].name
        name = self._references.name(vr)
        if kind not in ("inputs", "constants", "parameters", "tolerance"):
            self._refuse(name or f"value reference {vr}", "is not a Real variable that can be set")
            return
        if not -LARGEST <= value <= LARGEST:
            why = f"is too large: at most {LARGEST:g} is taken" if math.isfinite(value) else "is not a finite number"
            self._refuse(name, f"= {value!r} {why}; {self.get_real([vr])[0]!r} stays")
            return
        if kind == "constants" and place in self.model.POSITIVE and not value > 0.0:
            self._refuse(name, f"= {value!r} must be positive; {self._constants[place]!r} stays")
            return
        if kind == "constants":
            self._constants = (*self._constants[:place], float(value), *self._constants[place + 1 :])
        elif kind == "parameters":
            if self._initialized:
                self._refuse(name, f"= {value!r} comes too late: it is fixed once the FMU is initialized")
                return
            self._parameters = (*self._parameters[:place], float(value), *self._parameters[place + 1 :])
            self._unbound = True
        elif value > 0.0:
            self._tolerance = self._solver.tolerance = float(value)
        else:
            self._refuse(name, f"= {value!r} must be positive; {self._tolerance!r} stays")
            return
        self._refused.pop(name, None)
        self._touched = True
        self._forget()

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            name = self._references.name(vr)
            if name != "driven_by_time":
                self._refuse(name or f"value reference {vr}", "is not a Boolean variable that can be set")
            elif bool(value) == self._driven_by_time:
                self._refused.pop(name, None)
            elif self._initialized:
                self._refuse(name, f"= {bool(value)} comes too late: it is fixed once the FMU is initialized")
            else:
                self._driven_by_time = bool(value)
                self._forget()

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        for vr, value in zip(vrs, values, strict=True):
            name = self._references.name(vr)
            if name != "rates":
                self._refuse(name or f"value reference {vr}", "is not an Integer variable that can be set")
            elif value not in tuple(Rates):
                modes = f"{Rates.AUTO} (auto), {Rates.ESTIMATED} (estimated) or {Rates.WIRED} (wired)"
                self._refuse(name, f"= {value} must be {modes}; {self._rates} stays")
            elif value == self._rates:
                self._refused.pop(name, None)
            elif self._initialized:
                self._refuse(name, f"= {value} comes too late: it is fixed once the FMU is initialized")
            else:
                self._refused.pop(name, None)
                self._choose_rates(value)

    def _choose_rates(self, rates: int) -> None:
        self._rates = rates
        rate_inputs = [k for k in range(len(self._inputs)) if k % 3]
        if rates == Rates.AUTO:
            self._wired = {k for k in rate_inputs if self._inputs[k] != 0.0}
        else:
            self._wired = set(rate_inputs) if rates == Rates.WIRED else set()
        self._forget()

    def set_string(self, vrs: Sequence[int], values: Sequence[str]) -> None:
        for vr, _ in zip(vrs, values, strict=True):
            self._refuse(self._references.name(vr) or f"value reference {vr}", "is not a String that can be set")

    def _refuse(self, name: str, why: str) -> None:
        """Report that a value is refused; the next doStep returns Discard, since a setter cannot return Error."""
        self._refused[name] = f"{name} {why}"
        self.log(self._refused[name], Fmi2Status.error)
