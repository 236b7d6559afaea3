"""The tissue model: one soft body, held from below by attachments and from above by grasps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from defras_sim.geometry import Floats, Pose
from defras_sim.scene import ElementName, MaterialName, Scene
from defras_sim.surface import Surface
from defras_sim.tissue import grasp as grips
from defras_sim.tissue.grasp import Grasp, NothingToGrasp
from defras_sim.tissue.held_tissue import HeldTissue
from defras_sim.tissue.hole_response import HoleResponse, hole_response
from defras_sim.tissue.holes import Holes
from defras_sim.tissue.mesh import Integers
from defras_sim.tissue.own_terms import elastic_body, own_terms
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
        body = elastic_body(tissue, self.mesh, name)
        own = own_terms(tissue, body)
        self._surface = surface_map(self.mesh, tissue)
        self._dents = DentsOf(self.mesh, tissue, name)
        self._solver = NewtonSolver(NewtonSettings(residual_share * body.force_scale_n()))
        holes = Holes(self.mesh, scene, self._dents)
        self._rest_m: Floats = self.mesh.nodes_m
        if tissue.bed and is_loaded(own):
            # Attachments grew where the tissue lies: there they do not pull at it.
            self._rest_m = lying_m(self._solver, self.mesh.nodes_m, own)
            holes.anchor_at(self._rest_m)
        self._held = HeldTissue(len(self.mesh.nodes_m), own, holes)
        self._traveller = Traveller(self._solver, self._held.energy_at)
        self._response = LinearResponse(self.mesh.nodes_m)
        self._rest_is_known = False
        self._positions_m = self.rest_m.copy()

    @property
    def terms(self) -> Mapping[str, Term]:
        """What the energy is the sum of, by name."""
        return self._held.energy.terms

    def set_term(self, term: Term) -> None:
        """Add ``term``, or put it in the place of the one of its name; then solve again.

        A "material" of another stiffness leaves the dents at holes and jaws as they are; tissue of
        another modulus throughout is that of another scene.

        Raises:
            ValueError: the name is that of the attachments or of a grasp, which follow the holes
                and the arms.
        """
        if self._held.set_term(term):
            self._traveller.forget()
        self._rest_is_known = False

    def remove_term(self, name: str) -> None:
        """Take away a term that was added.

        Raises:
            ValueError: there is none of that name, or the tissue cannot be without it.
        """
        self._held.remove_term(name)
        self._traveller.forget()
        self._rest_is_known = False

    @property
    def hole_stiffness_n_per_m(self) -> Floats:
        """Stiffness of every hole (holes,), in the order of ``scene.holes_xy_m``."""
        return self._held.hole_stiffness_n_per_m

    def set_hole_stiffness(self, stiffness_n_per_m: Floats) -> None:
        """Give every hole its stiffness (holes,); zero is free.

        Raises:
            ValueError: wrong count, negative, or not finite.
        """
        self._held.set_hole_stiffness(stiffness_n_per_m)
        self._traveller.forget()
        self._rest_is_known = False

    def lift_attachments(self, height_m: float) -> None:
        """Let all attachments be ``height_m`` higher than modelled; then solve again.

        Raises:
            ValueError: not finite.
        """
        if self._held.lift_attachments(height_m):
            self._rest_is_known = False

    def scale_dents(self, factor: float) -> None:
        """Let the dents of holes and jaws be those of tissue ``factor`` times as stiff; then solve
        again.

        Raises:
            ValueError: not above zero, or not finite.
        """
        if self._held.scale_dents(factor):
            self._rest_is_known = False

    @property
    def rest_m(self) -> Floats:
        """Nodes (nodes, 3) where nobody holds the tissue: the mesh's own unless loads act.

        The lowest positions found, where that is no equilibrium.
        """
        if not self._rest_is_known:
            energy = self._held.energy_let_go()
            self._rest_m = settled(self._solver, energy, self._rest_m).positions_m
            self._rest_is_known = True
        return self._rest_m

    @property
    def rest_surface(self) -> Surface:
        """The surface where nobody holds the tissue."""
        return self._surface.surface(self.rest_m)

    @property
    def grasped_arms(self) -> tuple[str, ...]:
        return tuple(self._held.grasps)

    @property
    def tips(self) -> Tips:
        """Where the tips of the arms that hold tissue are."""
        return self._held.tips

    def grasp(self, arm: str, tissue_from_tip: Pose) -> None:
        """Take hold of the disc of the upper face that lies nearest to the tip as things stand.

        Raises:
            NothingToGrasp: the tip is farther than 8 mm from the upper face.
            ValueError: the arm holds tissue already.
        """
        if arm in self._held.grasps:
            raise ValueError(f"{arm} holds tissue already; release it first")
        surface = self._surface.surface(self._positions_m)
        upper = self.scene.tissue.shape.upper
        center = grips.nearest_on_upper_face(
            self.mesh, upper, self._positions_m, surface, tissue_from_tip.position_m
        )
        radius = self.scene.grasp.patch_radius_m
        patch = grips.grasped_patch(
            self.mesh, upper, self._positions_m, center, radius, tissue_from_tip, self._dents
        )
        self._hold({**self._held.grasps, arm: patch})

    def release(self, arm: str) -> None:
        """Let go. Tissue that nobody holds goes back to rest, unless loads keep it elsewhere: then
        it settles from where it is.

        Raises:
            ValueError: the arm holds nothing.
        """
        grasps = dict(self._held.grasps)
        if arm not in grasps:
            raise ValueError(f"{arm} holds no tissue; holding: {', '.join(grasps) or 'none'}")
        del grasps[arm]
        self._hold(grasps)
        if grasps:
            return
        if self._held.is_loaded:
            here = settled(self._solver, self._held.energy, self._positions_m)
            self._positions_m = here.positions_m
        else:
            self._positions_m = self.rest_m.copy()

    def reset(self) -> None:
        """Rest shape, nothing grasped."""
        self.restore(TissueSnapshot(self.rest_m, {}))

    def snapshot(self) -> TissueSnapshot:
        return TissueSnapshot(self._positions_m.copy(), dict(self._held.grasps))

    def restore(self, snapshot: TissueSnapshot) -> None:
        """Go back to ``snapshot``; holes and terms stay as they are now."""
        self._hold(snapshot.grasps)
        self._positions_m = snapshot.positions_m.copy()

    def solve(self, tips: Tips, change_m: Floats | None = None) -> TissueState:
        """Equilibrium with each holding arm's tip at its pose in ``tips``.

        Where other holes hold than before, the way may have to start again from rest. If that does
        not help, the state is the last good one, marked as not converged. ``change_m`` (nodes, 3):
        about how far the nodes go, where that is known; it saves work.

        Raises:
            ValueError: a holding arm has no pose, a pose is not finite, or an arm holds nothing.
        """
        self._check(tips)
        before = self.snapshot()
        moving = length_m(self._held.tips, tips) > 0
        converged, iterations = self._travel(tips, change_m)
        if not converged and not moving:
            unloaded = grips.unloaded(self._held.grasps, self.rest_m)
            self.restore(TissueSnapshot(self.rest_m, unloaded))
            converged, more = self._travel(tips)
            iterations += more
            if not converged:
                self.restore(before)
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
        _, gradient = self._held.energy.energy_and_gradient(self._positions_m)
        if not np.linalg.norm(gradient) <= UNBALANCED * self._solver.settings.residual_n:
            raise ValueError(
                "sensitivities belong to an equilibrium; call solve first "
                f"({np.linalg.norm(gradient):.2g} N are unbalanced)"
            )
        return sensitivities(
            Balance(self._held.energy, self._held.grasps, self._positions_m),
            self._surface,
            self._response.at(self._held.energy, self._positions_m),
            parameters,
        )

    def response_to_hole_forces(self, holes: Integers) -> HoleResponse:
        """Linear response of the surface and of ``holes`` to forces where ``holes`` hold."""
        return hole_response(
            self._held.attachments,
            self._positions_m,
            self._surface,
            self._response.at(self._held.energy, self._positions_m),
            holes,
        )

    def _hold(self, grasps: Mapping[str, Grasp]) -> None:
        """These grasps and no others hold; the way so far does not continue."""
        self._held.hold(grasps)
        self._traveller.forget()

    def _travel(self, tips: Tips, change_m: Floats | None = None) -> tuple[bool, int]:
        """Go towards ``tips`` as far as there are equilibria; (arrived, iterations)."""
        arrival = self._traveller.go(self._positions_m, self._held.tips, tips, change_m)
        self._positions_m = arrival.positions_m
        self._held.move(arrival.tips)
        return arrival.arrived, arrival.iterations

    def _check(self, tips: Tips) -> None:
        if set(tips) != set(self._held.grasps):
            raise ValueError(
                f"tips given for {sorted(tips)}; tissue is held by {sorted(self._held.grasps)}"
            )
        for arm, pose in tips.items():
            if not (np.all(np.isfinite(pose.position_m)) and np.all(np.isfinite(pose.rotation))):
                raise ValueError(f"the pose of {arm} is not finite: {pose}")

    def _state(self, converged: bool, iterations: int) -> TissueState:
        return tissue_state(
            self._held.energy.terms.values(),
            self._held.attachments,
            self._held.grasps,
            self._positions_m,
            self._surface,
            converged=converged,
            iterations=iterations,
        )
