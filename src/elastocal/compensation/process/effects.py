"""The error budget of a process: effects of the true cell that are switched off in turn."""

from dataclasses import dataclass, replace

from elastocal.cell import Cell


@dataclass(frozen=True)
class Effect:
    """A line of the error budget: something is switched off."""

    name: str
    quiet: bool = False
    """No noise, drift or cross-talk of the sensor, no stop error of the robot."""
    prompt: bool = False
    """No delay of filters and controller."""
    supple: bool = False
    """No backlash and hysteresis of the gears."""
    exact: bool = False
    """The deflection is known, though as late as the filters and the controller make it."""

    def changed(self, cell: Cell) -> Cell:
        """Return the cell with those parts of its simulated truth switched off."""
        simulation = cell.file.simulation
        update: dict[str, object] = {}
        if self.quiet:
            silent = {"force_noise": 0.0, "moment_noise": 0.0, "drift": 0.0, "cross_talk": 0.0}
            update["sensor"] = simulation.sensor.model_copy(update=silent)
            update["controller"] = simulation.controller.model_copy(update={"repeatability": 0.0})
        if self.supple:
            easy = {"backlash": 0.0, "hysteresis": 0.0}
            update["gears"] = simulation.gears.model_copy(update=easy)
        changed = simulation.model_copy(update=update)
        return replace(cell, file=cell.file.model_copy(update={"simulation": changed}))


BUDGET = (
    Effect("everything on"),
    Effect("without noise, drift, cross-talk, stop error", quiet=True),
    Effect("without delay of filters and controller", prompt=True),
    Effect("without backlash and hysteresis", supple=True),
    Effect("with a perfect model, delays on", exact=True),
    Effect("none of noise, delay, backlash: the model alone", quiet=True, prompt=True, supple=True),
)
