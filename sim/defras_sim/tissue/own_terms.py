"""The terms that every tissue of a scene has, whoever holds it: material, weight, bed."""

from __future__ import annotations

from defras_sim.scene import MaterialName, Tissue
from defras_sim.tissue.assembly import ElasticBody
from defras_sim.tissue.bed import bed_under
from defras_sim.tissue.curved_bed import bed_under_anatomy
from defras_sim.tissue.loads import gravity
from defras_sim.tissue.materials import lame_parameters
from defras_sim.tissue.mesh import Mesh
from defras_sim.tissue.terms import Term


def elastic_body(tissue: Tissue, mesh: Mesh, material: MaterialName) -> ElasticBody:
    """The base material, as stiff everywhere."""
    lame = lame_parameters(material, tissue.young_modulus_pa, tissue.poisson_ratio)
    return ElasticBody(mesh, material, *lame)


def own_terms(tissue: Tissue, body: ElasticBody) -> list[Term]:
    """``body``, its weight (of strength zero where the scene has no gravity), and its bed."""
    weight = gravity(body.points, tissue.density_kg_m3, tissue.gravity_m_s2)
    if not tissue.bed:
        return [body, weight]
    if tissue.anatomy is None:
        return [body, weight, bed_under(body.mesh, tissue)]
    return [body, weight, bed_under_anatomy(body.mesh, tissue.anatomy)]
