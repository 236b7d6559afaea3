"""The tissue model: one soft body, held from below by attachments and from above by grasps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ElementName, MaterialName, Scene
from defras_sim.surface import Surface
from defras_sim.tissue import grasp as grips
from defras_sim.tissue import holes as attachments
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.bed import bed_under
from defras_sim.tissue.curved_bed import bed_under_anatomy
from defras_sim.tissue.equilibrium import PotentialEnergy
from defras_sim.tissue.grasp import Grasp, NothingToGrasp
from defras_sim.tissue.hole_response import HoleResponse, hole_response
from defras_sim.tissue.holes import Holes
from defras_sim.tissue.loads import gravity
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.parameters import Balance, Parameter
from defras_sim.tissue.path import length_m
from defras_sim.tissue.readout import tissue_state
from defras_sim.tissue.response import LinearResponse
from defras_sim.tissue.rest import is_loaded, lying_m, settled
from defras_sim.tissue.sensitivity import Sensitivities, sensitivities
from defras_sim.tissue.solver import NewtonSettings, NewtonSolver
from defras_sim.tissue.state import TissueState
from defras_sim.tissue.surface import surface_map
from defras_sim.tissue.terms import Term
from defras_sim.tissue.tissue_mesh import tissue_mesh
from defras_sim.tissue.travel import Tips, Traveller
from defras_sim.tissue.unresolved import DentsOf

__all__ = ["NothingToGrasp", "TissueModel", "TissueSnapshot"]


# Times the residual at which a solve has converged: more means that something changed since.
UNBALANCED = 2.0


@dataclass(frozen=True)
class TissueSnapshot:
    """Everything a :class:`TissueModel` needs to go on from here."""

    positions_m: Floats
    grasps: Mapping[str, Grasp]


class TissueModel:
    """Quasi-static tissue of a scene. Not thread-safe; use one model a thread.

    Its energy is the sum of ``terms``: "material", "gravity" (of strength zero unless the scene has
    some), "bed" where there is one, "attachments", a "grasp of ..." for each arm that holds, and
    whatever :meth:`set_term` adds.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        element: ElementName | None = None,
        elements_xyz: tuple[int, int, int] | None = None,
        material: MaterialName | None = None,
        residual_share: float = 4e-5,
    ) -> None:
        tissue = scene.tissue
        self.scene = scene
        self.mesh = tissue_mesh(
            tissue, element or tissue.element, elements_xyz or tissue.elements_xyz
        )
        name = material or tissue.material
        mu, lam = lame_parameters(name, tissue.young_modulus_pa, tissue.poisson_ratio)
        body = ElasticBody(self.mesh, name, mu, lam)
        self._terms: dict[str, Term] = {
            term.name: term
            for term in (body, gravity(body.points, tissue.density_kg_m3, tissue.gravity_m_s2))
        }
        if tissue.bed:
            bed: Term = (
                bed_under(self.mesh, tissue)
                if tissue.anatomy is None
                else bed_under_anatomy(self.mesh, tissue.anatomy)
            )
            self._terms[bed.name] = bed
        self._surface = surface_map(self.mesh, tissue)
        self._dents = DentsOf(self.mesh, tissue, name)
        self._holes = Holes(self.mesh, scene, self._dents)
        self._grasps: dict[str, Grasp] = {}
        self._solver = NewtonSolver(NewtonSettings(residual_share * body.force_scale_n()))
        self._traveller = Traveller(self._solver, self._energy_at)
        self._rest_m: Floats = self.mesh.nodes_m
        if tissue.bed and is_loaded(self._terms.values()):
            # Attachments grew where the tissue lies: there they do not pull at it.
            self._rest_m = lying_m(self._solver, self.mesh.nodes_m, self._terms.values())
            self._holes.anchor_at(self._rest_m)
        self._rest_is_known = False
        self._energy = self._assembled()
        self._response = LinearResponse(self.mesh.nodes_m)
        self._positions_m = self.rest_m.copy()

    @property
    def terms(self) -> Mapping[str, Term]:
        """What the energy is the sum of, by name."""
        return self._energy.terms

    def set_term(self, term: Term) -> None:
        """Add ``term``, or put it in the place of the one of its name; then solve again.

        A "material" of another stiffness leaves the dents at holes and jaws as they are; tissue of
        another modulus throughout is that of another scene.

        Raises:
            ValueError: the name is that of the attachments or of a grasp, which follow the holes
                and the arms.
        """
        if term.name == attachments.TERM_NAME or term.name in map(grips.term_name, self._grasps):
            raise ValueError(
                f"term {term.name!r} follows the holes and the arms; use set_hole_stiffness, "
                "grasp, release and solve"
            )
        old = self._terms.get(term.name)
        self._terms[term.name] = term
        self._rest_is_known = False
        if old is not None and old.pairs is term.pairs:
            self._energy = self._energy.with_term(term)
        else:
            self._changed()

    def remove_term(self, name: str) -> None:
        """Take away a term that was added.

        Raises:
            ValueError: there is none of that name, or the tissue cannot be without it.
        """
        if name == "material" or name not in self._terms:
            known = ", ".join(other for other in self._terms if other != "material")
            raise ValueError(f"no term {name!r} to take away; there are: {known}")
        del self._terms[name]
        self._rest_is_known = False
        self._changed()

    @property
    def hole_stiffness_n_per_m(self) -> Floats:
        """Stiffness of every hole (holes,), in the order of ``scene.holes_xy_m``."""
        return self._holes.stiffness_n_per_m

    def set_hole_stiffness(self, stiffness_n_per_m: Floats) -> None:
        """Give every hole its stiffness (holes,); zero is free.

        Raises:
            ValueError: wrong count, negative, or not finite.
        """
        self._holes.stiffness_n_per_m = stiffness_n_per_m
        self._rest_is_known = False
        self._changed()

    @property
    def rest_m(self) -> Floats:
        """Nodes (nodes, 3) where nobody holds the tissue: the mesh's own unless loads act.

        The lowest positions found, where that is no equilibrium.
        """
        if not self._rest_is_known:
            energy = PotentialEnergy(len(self.mesh.nodes_m), self._terms_but_grasps())
            self._rest_m = settled(self._solver, energy, self._rest_m).positions_m
            self._rest_is_known = True
        return self._rest_m

    @property
    def rest_surface(self) -> Surface:
        """The surface where nobody holds the tissue."""
        return self._surface.surface(self.rest_m)

    @property
    def grasped_arms(self) -> tuple[str, ...]:
        return tuple(self._grasps)

    def grasp(self, arm: str, tissue_from_tip: Pose) -> None:
        """Take hold of the disc of the upper face that lies nearest to the tip as things stand.

        Raises:
            NothingToGrasp: the tip is farther than 8 mm from the upper face.
            ValueError: the arm holds tissue already.
        """
        if arm in self._grasps:
            raise ValueError(f"{arm} holds tissue already; release it first")
        surface = self._surface.surface(self._positions_m)
        upper = self.scene.tissue.shape.upper
        center = grips.nearest_on_upper_face(
            self.mesh, upper, self._positions_m, surface, tissue_from_tip.position_m
        )
        radius = self.scene.grasp.patch_radius_m
        self._grasps[arm] = grips.grasped_patch(
            self.mesh, upper, self._positions_m, center, radius, tissue_from_tip, self._dents
        )
        self._changed()

    def release(self, arm: str) -> None:
        """Let go. Tissue that nobody holds goes back to rest, unless loads keep it elsewhere: then
        it settles from where it is.

        Raises:
            ValueError: the arm holds nothing.
        """
        if arm not in self._grasps:
            raise ValueError(f"{arm} holds no tissue; holding: {', '.join(self._grasps) or 'none'}")
        del self._grasps[arm]
        self._changed()
        if self._grasps:
            return
        if is_loaded(self._terms.values()):
            self._positions_m = settled(self._solver, self._energy, self._positions_m).positions_m
        else:
            self._positions_m = self.rest_m.copy()

    def reset(self) -> None:
        """Rest shape, nothing grasped."""
        self.restore(TissueSnapshot(self.rest_m, {}))

    def snapshot(self) -> TissueSnapshot:
        return TissueSnapshot(self._positions_m.copy(), dict(self._grasps))

    def restore(self, snapshot: TissueSnapshot) -> None:
        """Go back to ``snapshot``; holes and terms stay as they are now."""
        others = grips.spring_order(snapshot.grasps) != grips.spring_order(self._grasps)
        self._grasps = dict(snapshot.grasps)
        if others:
            self._changed()
        self._place(snapshot)

    def solve(self, tips: Tips) -> TissueState:
        """Equilibrium with each holding arm's tip at its pose in ``tips``.

        Where other holes hold than before, the way may have to start again from rest. If that does
        not help, the state is the last good one, marked as not converged.

        Raises:
            ValueError: a holding arm has no pose, a pose is not finite, or an arm holds nothing.
        """
        self._check(tips)
        before = self.snapshot()
        moving = length_m(self._tips(), tips) > 0
        converged, iterations = self._travel(tips)
        if not converged and not moving:
            self._place(TissueSnapshot(self.rest_m, grips.unloaded(self._grasps, self.rest_m)))
            converged, more = self._travel(tips)
            iterations += more
            if not converged:
                self._place(before)
        return self._state(converged, iterations)

    def sensitivities(self, parameters: Sequence[Parameter]) -> Sensitivities:
        """Derivatives of positions and forces at the last equilibrium by ``parameters``.

        Example:
            >>> tip = TipMotion("psm1")
            >>> by = model.sensitivities([YOUNG_MODULUS_SCALE, HoleStiffness(17), tip])
            >>> felt_stiffness = by.grasp_forces_by["psm1"][:, by.columns[tip]]

        Raises:
            ValueError: a parameter does not exist or is given twice, or something was changed and
                not solved since.
        """
        _, gradient = self._energy.energy_and_gradient(self._positions_m)
        if not np.linalg.norm(gradient) <= UNBALANCED * self._solver.settings.residual_n:
            raise ValueError(
                "sensitivities belong to an equilibrium; call solve first "
                f"({np.linalg.norm(gradient):.2g} N are unbalanced)"
            )
        return sensitivities(
            Balance(self._energy, self._grasps, self._positions_m),
            self._surface,
            self._response.at(self._energy, self._positions_m),
            parameters,
        )

    def response_to_hole_forces(self, holes: Integers) -> HoleResponse:
        """Linear response of the surface and of ``holes`` to forces where ``holes`` hold."""
        return hole_response(
            self._holes.term,
            self._positions_m,
            self._surface,
            self._response.at(self._energy, self._positions_m),
            holes,
        )

    def _changed(self) -> None:
        """What holds the tissue is different from now on."""
        self._traveller.forget()
        self._energy = self._assembled()

    def _assembled(self) -> PotentialEnergy:
        held = [grasp.term(arm) for arm, grasp in self._grasps.items()]
        return PotentialEnergy(len(self.mesh.nodes_m), [*self._terms_but_grasps(), *held])

    def _terms_but_grasps(self) -> Iterator[Term]:
        yield from self._terms.values()
        yield self._holes.term

    def _tips(self) -> dict[str, Pose]:
        return {arm: grasp.tissue_from_tip for arm, grasp in self._grasps.items()}

    def _place(self, snapshot: TissueSnapshot) -> None:
        self._positions_m = snapshot.positions_m.copy()
        self._grasps = dict(snapshot.grasps)
        self._energy = self._energy_at(self._tips())
        self._traveller.forget()

    def _travel(self, tips: Tips) -> tuple[bool, int]:
        """Go towards ``tips`` as far as there are equilibria; (arrived, iterations)."""
        arrival = self._traveller.go(self._positions_m, self._tips(), tips)
        self._positions_m = arrival.positions_m
        self._grasps = self._grasps_at(arrival.tips)
        self._energy = self._energy_at(arrival.tips)
        return arrival.arrived, arrival.iterations

    def _grasps_at(self, tips: Tips) -> dict[str, Grasp]:
        return {
            arm: replace(grasp, tissue_from_tip=tips[arm]) for arm, grasp in self._grasps.items()
        }

    def _energy_at(self, tips: Tips) -> PotentialEnergy:
        """The energy with each holding arm's tip at its pose in ``tips``."""
        energy = self._energy
        for arm, grasp in self._grasps_at(tips).items():
            energy = energy.with_term(grasp.term(arm))
        return energy

    def _check(self, tips: Tips) -> None:
        if set(tips) != set(self._grasps):
            raise ValueError(
                f"tips given for {sorted(tips)}; tissue is held by {sorted(self._grasps)}"
            )
        for arm, pose in tips.items():
            if not (np.all(np.isfinite(pose.position_m)) and np.all(np.isfinite(pose.rotation))):
                raise ValueError(f"the pose of {arm} is not finite: {pose}")

    def _state(self, converged: bool, iterations: int) -> TissueState:
        return tissue_state(
            self._energy.terms.values(),
            self._holes.term,
            self._grasps,
            self._positions_m,
            self._surface,
            converged=converged,
            iterations=iterations,
        )
