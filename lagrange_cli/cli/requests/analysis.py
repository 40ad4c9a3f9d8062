"""Request of a call of ``lagrange analyze``, and the options that exclude each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation
    from lagrange_cli.api.analyzed import Analyzed
    from lagrange_cli.cli.session import Session

#: Accuracy of a motion along which the system is linearized.
_ACCURACY = 1e-6


@dataclass(frozen=True)
class AnalysisRequest:
    """The parts of an analysis that a call asks for, and where.

    Attributes
    ----------
    parts
        Names of the parts of an analysis that are named; all that can be found if there are none.
    at
        The equilibrium, as values by name.
    steady
        Steady motions take the place of equilibria.
    branches
        A parameter, and the ends of its values; None for no branches.
    lyapunov, along
        End of the motion whose exponents are found, or along which the system is linearized.
    response
        Lowest and highest angular frequency of a frequency response.
    accuracy, samples
        Of the motion that ``along`` ends.
    """

    parts: tuple[str, ...]
    at: dict[str, str]
    steady: bool
    branches: tuple[str, str, str] | None
    lyapunov: float | None
    along: float | None
    response: tuple[float, float] | None
    accuracy: float | None
    samples: int | None

    @property
    def of_motions(self) -> bool:
        """True if a motion is integrated."""
        return self.lyapunov is not None or self.along is not None

    @property
    def _of_rest(self) -> bool:
        """True if parts of an analysis are asked for beside motions and responses."""
        return bool(self.parts or self.steady or self.branches)

    def require_use(self) -> None:
        """Refuse options that nothing would read, or that exclude each other."""
        for option, value in (("--accuracy", self.accuracy), ("--samples", self.samples)):
            if value is not None and self.along is None:
                raise click.UsageError(f"{option} is for --along")
        if self.at and self.of_motions and not self._of_rest:
            message = "--at is for parts at an equilibrium; a motion begins at 'initial'"
            raise click.UsageError(message)
        if self.steady and self.response is not None:
            raise click.UsageError("--response is at rest, not of steady motions")

    def require_linear_system(self, *, linearization: bool) -> None:
        """Refuse an ``.npz`` file of what has no matrices."""
        others = self.parts or self.branches is not None
        if others and not linearization and self.along is None and self.response is None:
            raise click.UsageError("an .npz file holds the linear system; add --linearization")

    def analysis(self, derivation: Derivation, session: Session) -> Analyzed:
        """Find out what is asked for."""
        analysis = self._at_rest(derivation)
        if self.lyapunov is not None:
            with session.progress("following neighbouring motions") as move:
                exponents = derivation.lyapunov(until=self.lyapunov, progress=move).summary
            analysis = replace(analysis, exponents=exponents)
        if self.along is not None:
            accuracy = _ACCURACY if self.accuracy is None else self.accuracy
            motion = derivation.linearize(until=self.along, accuracy=accuracy, samples=self.samples)
            analysis = replace(analysis, along=motion.summary)
        if self.response is not None:
            response = derivation.frequency_response(*self.response, at=self.at)
            analysis = replace(analysis, response=response)
        return analysis

    def _at_rest(self, derivation: Derivation) -> Analyzed:
        """Return the analysis of equilibria; of the equations alone if none is asked for."""
        from lagrange_cli.api.analyzed import Analyzed

        if not self._of_rest and (self.of_motions or self.response is not None):
            return Analyzed(derivation.equations)
        over = None if self.branches is None else {self.branches[0]: self.branches[1:]}
        return derivation.analyze(*self.parts, at=self.at, steady=self.steady, branches=over)


@dataclass(frozen=True)
class AnalysisPictures:
    """Files of pictures, None for those that are not drawn.

    Attributes
    ----------
    diagram, loci
        Bifurcation diagram, and root loci, of branches.
    bode
        Bode diagram of a response.
    shapes, moving
        Shapes of the modes, still and moving.
    """

    diagram: str | None = None
    loci: str | None = None
    bode: str | None = None
    shapes: str | None = None
    moving: str | None = None

    @classmethod
    def of(
        cls, request: AnalysisRequest, plot: str | None, loci: str | None, animate: str | None
    ) -> AnalysisPictures:
        """Tell which pictures options ask for.

        Raises
        ------
        click.UsageError
            ``plot`` may be several of them, or there is nothing that they show.
        """
        if loci is not None and request.branches is None:
            message = "--loci draws poles along branches; add --branches NAME=FROM..TO"
            raise click.UsageError(message)
        shown = _shown_by_plot(request) if plot is not None else None
        if animate is not None:
            _require_modes(request, "--animate", "")
        drawn = {} if shown is None else {shown: plot}
        return cls(loci=loci, moving=animate, **drawn)

    @property
    def of_branches(self) -> dict[str, str]:
        """Pictures that belong to branches: name → path."""
        drawn = {"diagram": self.diagram, "loci": self.loci}
        return {name: path for name, path in drawn.items() if path is not None}

    def draw_others(
        self, derivation: Derivation, request: AnalysisRequest, session: Session
    ) -> None:
        """Draw modes and a response; say what is not drawn."""
        remarks = []
        if self.shapes is not None:
            remarks.append(derivation.plot_modes(self.shapes, at=request.at))
        if self.moving is not None:
            remarks.append(derivation.animate_modes(self.moving, at=request.at))
        for remark in dict.fromkeys(filter(None, remarks)):
            session.remark(remark)
        if self.bode is not None and request.response is not None:
            response = derivation.frequency_response(*request.response, at=request.at)
            derivation.plot_response(self.bode, response)


def _shown_by_plot(request: AnalysisRequest) -> str:
    """Return the name of the one picture that ``--plot`` is."""
    modes = "modes" in request.parts
    if request.response is not None and (modes or request.branches is not None):
        message = "--plot draws the response, the modes or the branches; ask for one at a time"
        raise click.UsageError(message)
    if request.response is not None:
        return "bode"
    if modes and request.branches is not None:
        message = "--plot draws one picture; ask for --branches alone, or without them"
        raise click.UsageError(message)
    if request.branches is not None:
        return "diagram"
    _require_modes(request, "--plot", ", or --response FROM..TO")
    return "shapes"


def _require_modes(request: AnalysisRequest, option: str, more: str) -> None:
    if "modes" not in request.parts:
        raise click.UsageError(f"{option} draws the shapes of modes; add --modes{more}")
    if request.steady:
        raise click.UsageError(f"{option} draws modes at rest, not those of steady motions")
