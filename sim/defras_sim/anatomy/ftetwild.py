"""Fills a closed surface with tetrahedra.

The work is fTetWild's (Hu et al., Fast tetrahedral meshing in the wild, ACM Trans. Graph. 39,
2020), through ``pytetwild`` (both MPL 2.0). It runs in a process of its own: it leaves files in
its working directory, and what is compiled in C++ should not be able to end an operation.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from defras_sim.anatomy.anatomy import VolumeMesh
from defras_sim.anatomy.refused import RefusedSurface
from defras_sim.anatomy.solid import Solid
from defras_sim.geometry import Floats

TIME_OUT_S = 600
# How far the mesh may leave the surface: a share of its edges, which cut across bends anyhow.
_ENVELOPE = 0.04


def filled(solid: Solid, edge_m: float) -> VolumeMesh:
    """Tetrahedra with edges of about ``edge_m``.

    Raises:
        RefusedSurface: the mesher fails, or takes longer than :data:`TIME_OUT_S`.
    """
    size_m = float(np.linalg.norm(np.ptp(solid.vertices_m, axis=0)))
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder) / "surface.npz", Path(folder) / "mesh.npz"
        np.savez(
            given,
            vertices=solid.vertices_m,
            triangles=solid.triangles.astype(np.int32),
            edge=edge_m,
            envelope=_ENVELOPE * edge_m / size_m,
        )
        command = [sys.executable, "-m", "defras_sim.anatomy.ftetwild", given.name, made.name]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, timeout=TIME_OUT_S, check=False
            )
        except subprocess.TimeoutExpired as error:
            raise RefusedSurface(
                f"no mesh was found in {TIME_OUT_S} s; the surface has {len(solid.triangles)} "
                "triangles: fewer, or a smoother surface, may do"
            ) from error
        if done.returncode != 0 or not made.is_file():
            said = (done.stderr or done.stdout).strip().splitlines()
            raise RefusedSurface(
                f"the mesher failed (exit {done.returncode}): {said[-1] if said else 'no message'}"
            )
        with np.load(made) as arrays:
            return _upright(arrays["nodes"], arrays["tetrahedra"].astype(np.int64))


def _upright(nodes_m: Floats, tetrahedra: NDArray[np.int64]) -> VolumeMesh:
    """Every tetrahedron with positive volume, as elements need it; unused nodes left out."""
    used, packed = np.unique(tetrahedra, return_inverse=True)
    nodes_m, tetrahedra = nodes_m[used].astype(float), packed.reshape(-1, 4)
    corners = nodes_m[tetrahedra]
    turned = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 2, 1, 3]]
    return VolumeMesh(nodes_m, tetrahedra)


def _main(given: str, made: str) -> None:
    """Mesh what lies in the file ``given``; in the process of its own."""
    import pytetwild

    with np.load(given) as arrays:
        nodes, tetrahedra = pytetwild.tetrahedralize(
            arrays["vertices"],
            arrays["triangles"],
            edge_length_abs=float(arrays["edge"]),
            epsilon=float(arrays["envelope"]),
            num_threads=1,
        )
    np.savez(made, nodes=nodes, tetrahedra=tetrahedra)


if __name__ == "__main__":
    _main(*sys.argv[1:3])
