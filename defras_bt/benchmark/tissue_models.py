"""Models of tissue under one interface, so that the same motions run on all of them."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from defras_bt.benchmark.felupe_slab import FelupeSlab
from defras_bt.benchmark.tissue_motions import Motion, surface_grid_m
from defras_sim.geometry import Floats, Pose
from defras_sim.scene import MaterialName
from defras_sim.tissue.grasp import nodes_under_jaw
from defras_sim.tissue.mesh import Integers, slab_mesh
from defras_sim.tissue.model import TissueModel
from defras_sim.worlds.bullet_tissue import BulletTissue
from defras_sim.worlds.native_output import STDERR, without_native_output

ARM = "psm1"
TOOL_SPEED_M_S = 0.015
"""As fast as scenes move tissue."""


class TissueContestant(Protocol):
    """Tissue that is held and grasped as a motion says, at its start."""

    @property
    def title(self) -> str: ...

    def go_to(self, tip: Pose) -> None:
        """Take the tip to ``tip``; dynamic tissue gets the time that takes at 15 mm/s.

        Raises:
            ArithmeticError: the model could not follow.
        """
        ...

    def force_n(self) -> Floats:
        """Force (3,) of the jaw on the tissue."""
        ...

    def surface_m(self) -> Floats:
        """The upper face (625, 3), see ``surface_grid_m``."""
        ...


class OwnTissue:
    """This project's model, as twins run it."""

    def __init__(
        self,
        motion: Motion,
        material: MaterialName,
        cells_xyz: tuple[int, int, int] | None = None,
    ) -> None:
        scene = motion.scene()
        self._model = TissueModel(scene, material=material, elements_xyz=cells_xyz)
        self._grid = self._model.mesh.interpolation(surface_grid_m(scene.tissue))
        self._model.grasp(ARM, motion.start)
        self._state = self._model.solve({ARM: motion.start})
        self.title = f"defras {_named(cells_xyz or scene.tissue.elements_xyz)}"
        self.unknowns = self._model.mesh.nodes_m.size

    def go_to(self, tip: Pose) -> None:
        self._state = self._model.solve({ARM: tip})
        if not self._state.converged:
            raise ArithmeticError("the solve did not converge")

    def force_n(self) -> Floats:
        return self._state.grasp_forces_n[ARM]

    def surface_m(self) -> Floats:
        return self._grid @ self._state.nodes_m


class FelupeTissue:
    """felupe on the mesh of this project's model, with its own Newton method and its own rule of 27
    points, without dents; the linear solver is Pardiso where pypardiso is installed."""

    def __init__(
        self,
        motion: Motion,
        material: MaterialName,
        cells_xyz: tuple[int, int, int] | None = None,
    ) -> None:
        scene = motion.scene()
        cells = cells_xyz or scene.tissue.elements_xyz
        self._slab = FelupeSlab(scene, material, "hexahedron20", cells, np.array(motion.grasp_xy_m))
        self._start_m = motion.start.position_m
        self._grid = self._slab.interpolation(surface_grid_m(scene.tissue))
        self._solver = _pardiso()
        self.title = f"felupe {_named(cells)}"
        self.unknowns = self._slab.nodes_m.size

    def go_to(self, tip: Pose) -> None:
        self._slab.move_tip_to(tip.position_m - self._start_m)
        try:
            self._slab.solve(solver=self._solver)
        except ValueError as error:
            raise ArithmeticError(f"felupe: {error}") from error

    def force_n(self) -> Floats:
        return self._slab.grasp_force_n()

    def surface_m(self) -> Floats:
        return self._grid @ self._slab.positions_m


class BulletSlab:
    """PyBullet's deformable, 12x12x1 linear tetrahedra at 1 ms, on a tool that moves as told."""

    title = "PyBullet 12x12x1"
    _TOOL_KG = 0.05
    _GRIP_N = 1000.0

    def __init__(self, motion: Motion) -> None:
        with without_native_output(STDERR):
            import pybullet
            from pybullet_utils.bullet_client import BulletClient
        scene = motion.scene()
        self._step_s = scene.simulation.bullet_step_s
        start = motion.start.position_m
        with without_native_output():
            client: Any = BulletClient(connection_mode=pybullet.DIRECT)
            client.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
            client.setGravity(0, 0, 0)
            client.setTimeStep(self._step_s)
            self._tissue = BulletTissue(client, scene)
            tool = client.createMultiBody(self._TOOL_KG, -1, -1, list(start))
            self._fixed = client.createConstraint(
                tool, -1, -1, -1, client.JOINT_FIXED, [0, 0, 0], [0, 0, 0], list(start)
            )
            self._tissue.grip(tool, Pose(start), self._tissue.patch_at(start))
        self._client = client
        self._tip_m: Floats = start
        self._force_n: Floats = np.zeros(3)

    def go_to(self, tip: Pose) -> None:
        way = tip.position_m - self._tip_m
        steps = max(1, round(float(np.linalg.norm(way)) / TOOL_SPEED_M_S / self._step_s))
        felt = np.zeros(3)
        last = max(1, min(steps, 50))  # forces tremble; the mean of 50 ms is read
        for number in range(1, steps + 1):
            here = self._tip_m + way * number / steps
            self._client.changeConstraint(self._fixed, list(here), maxForce=self._GRIP_N)
            self._client.stepSimulation()
            if number > steps - last:
                felt += self._client.getConstraintState(self._fixed)[:3]
        self._tip_m, self._force_n = tip.position_m, felt / last
        nodes = self._tissue.nodes_m()
        if not np.isfinite(nodes).all() or np.abs(nodes).max() > 1.0:
            raise ArithmeticError("PyBullet's tissue became unstable")

    def force_n(self) -> Floats:
        return self._force_n

    def surface_m(self) -> Floats:
        surface = self._tissue.surface()
        return surface.vertices_m[surface.upper]


class MujocoSlab:
    """MuJoCo's flex, 12x12x1 linear tetrahedra at 4 ms ("discrete" is the integrator it needs)."""

    title = "MuJoCo flex 12x12x1"
    _STEP_S = 0.004
    _DAMPING_S = 0.02

    def __init__(self, motion: Motion) -> None:
        """
        Raises:
            ModuleNotFoundError: MuJoCo is not installed.
        """
        import mujoco

        # It would write MUJOCO_LOG.TXT into the current folder.
        mujoco.set_mju_user_warning(_unheard)
        self._mujoco = mujoco
        scene = motion.scene()
        tissue, cells = scene.tissue, scene.simulation.bullet_elements_xyz
        mesh = slab_mesh(tissue, "tetrahedron4", cells)
        held = np.zeros(len(mesh.nodes_m), bool)
        near = scene.attachments.hole_pitch_m / 2 + 1e-6
        for hole in scene.holes_xy_m[scene.attached]:
            held |= np.all(np.abs(mesh.nodes_m[:, :2] - hole) <= near, axis=1)
        held &= mesh.nodes_m[:, 2] < -tissue.thickness_m + 1e-6
        taken = nodes_under_jaw(mesh, np.array(motion.grasp_xy_m), scene.grasp.patch_radius_m)
        size = np.array([tissue.length_x_m, tissue.width_y_m, tissue.thickness_m])
        order = _grid_order(cells)
        xml = _flex_xml(
            step_s=self._STEP_S,
            counts=np.array(cells) + 1,
            spacing_m=size / cells,
            middle_m=-tissue.thickness_m / 2,
            mass_kg=float(tissue.density_kg_m3 * size.prod()),
            young_pa=tissue.young_modulus_pa,
            poisson=tissue.poisson_ratio,
            damping_s=self._DAMPING_S,
            pins=order[held],
            taken=order[taken],
            tool_m=motion.start.position_m,
        )
        self._model: Any = mujoco.MjModel.from_xml_string(xml)
        self._data: Any = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._order = order
        self._rows = 3 * len(taken)
        self._tip_m: Floats = motion.start.position_m
        self._grid = mesh.interpolation(surface_grid_m(tissue))
        self._force_n: Floats = np.zeros(3)

    def go_to(self, tip: Pose) -> None:
        way = tip.position_m - self._tip_m
        steps = max(1, round(float(np.linalg.norm(way)) / TOOL_SPEED_M_S / self._STEP_S))
        felt = np.zeros(3)
        last = max(1, min(steps, 12))
        for number in range(1, steps + 1):
            self._data.mocap_pos[0] = self._tip_m + way * number / steps
            self._mujoco.mj_step(self._model, self._data)
            if number > steps - last:
                felt += self._data.efc_force[: self._rows].reshape(-1, 3).sum(axis=0)
        self._tip_m, self._force_n = tip.position_m, felt / last
        nodes = self._data.flexvert_xpos
        if not np.isfinite(nodes).all() or np.abs(nodes).max() > 1.0:
            raise ArithmeticError("MuJoCo's tissue became unstable")

    def force_n(self) -> Floats:
        return self._force_n

    def surface_m(self) -> Floats:
        return self._grid @ self._data.flexvert_xpos[self._order]


def _unheard(message: str) -> None:
    """MuJoCo's warnings; the notes of the benchmark tell of them."""


def mujoco_is_installed() -> bool:
    """Whether the extra ``[bench]`` is there."""
    from importlib.util import find_spec

    return find_spec("mujoco") is not None


def _named(cells_xyz: tuple[int, int, int]) -> str:
    return "x".join(map(str, cells_xyz))


def _pardiso() -> Any:
    """felupe's solver where it can be had; None for felupe's default, SciPy's SuperLU."""
    try:
        from pypardiso import spsolve
    except ImportError:
        return None
    return spsolve


def _grid_order(cells_xyz: tuple[int, int, int]) -> Integers:
    """Number in MuJoCo's grid, z fastest, of every node of this project's, x fastest."""
    nx, ny, nz = (count + 1 for count in cells_xyz)
    return np.arange(nx * ny * nz).reshape(nx, ny, nz).transpose(2, 1, 0).ravel()


def _flex_xml(
    *,
    step_s: float,
    counts: Integers,
    spacing_m: Floats,
    middle_m: float,
    mass_kg: float,
    young_pa: float,
    poisson: float,
    damping_s: float,
    pins: Integers,
    taken: Integers,
    tool_m: Floats,
) -> str:
    def listed(values: Any) -> str:
        return " ".join(f"{value:.9g}" for value in values)

    grips = "".join(
        f'<connect body1="slab_{node}" body2="tool" anchor="0 0 0" solref="0.008 1"/>'
        for node in taken.tolist()
    )
    return f"""<mujoco>
  <option timestep="{step_s}" gravity="0 0 0" integrator="discrete"/>
  <size memory="256M"/>
  <worldbody>
    <body name="tool" mocap="true" pos="{listed(tool_m)}"/>
    <flexcomp name="slab" type="grid" dim="3" count="{" ".join(map(str, counts))}"
      spacing="{listed(spacing_m)}" pos="0 0 {middle_m}" mass="{mass_kg:.6g}" radius="0.0005">
      <elasticity young="{young_pa}" poisson="{poisson}" damping="{damping_s}"/>
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <edge equality="false"/>
      <pin id="{" ".join(map(str, pins.tolist()))}"/>
    </flexcomp>
  </worldbody>
  <equality>{grips}</equality>
</mujoco>"""
