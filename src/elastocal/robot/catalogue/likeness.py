"""Estimate the masses of a robot from those of a sister with sourced ones."""

from elastocal.robot.catalogue.record import CatalogueEntry, Dimensions, Inertias, LinkInertia


def inertias_like(sister: CatalogueEntry, arm: Dimensions) -> Inertias:
    """Return a sister's mass properties with the centres of mass moved along the links.

    Masses and tensors stay: castings and motors of a family differ less than their lengths. The
    estimate is always marked as an assumption.

    Parameters
    ----------
    sister : CatalogueEntry
        Robot of about the same size whose masses have a source.
    arm : Dimensions
        Of the robot that the estimate is for.
    """
    had = sister.dimensions
    along = {
        "link_1": (arm.a1 / had.a1, arm.c1 / had.c1),
        "link_2": (arm.c2 / had.c2, 1.0),
        "link_3": (arm.c3 / had.c3, arm.a2 / had.a2),
    }
    links = {
        name: _moved(link, *along.get(name, (1.0, 1.0)))
        for name, link in sister.inertia.links.items()
    }
    reason = (
        f"estimated from {sister.name}: its masses and inertias, centres of mass moved in"
        " proportion to the lengths of the links"
    )
    return Inertias(assumption=reason, links=links)


def _moved(link: LinkInertia, x: float, z: float) -> LinkInertia:
    centre = (link.centre[0] * x, link.centre[1], link.centre[2] * z)
    return link.model_copy(update={"centre": centre})
