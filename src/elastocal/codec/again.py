"""The observation systems behind a finished codec, built again from the readings."""

import numpy as np
from numpy.typing import ArrayLike

from elastocal.codec.campaign import make_campaign
from elastocal.codec.data import CodecData
from elastocal.codec.training import Trainee
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, layout
from elastocal.errors import CodecError
from elastocal.robot import Robot

_SAME = 1e-9
"""Largest distance of a pose from where the codec has it, in m."""


def trainees_of(
    robot: Robot, readings: Readings, data: CodecData, marker_offset: ArrayLike | None = None
) -> tuple[Trainee, ...]:
    """Return what each variant of a codec was trained with.

    Parameters
    ----------
    robot : Robot
        The robot.
    readings : Readings
        Those that the codec was made from.
    data : CodecData
        The codec.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.

    Raises
    ------
    CodecError
        If the readings have other poses than the codec, or a layout has other springs.
    DatasetError
        If the data lack a load case, or joints are not this robot's.
    """
    models = {
        each.springs: ElasticModel(robot, layout(robot, each.springs)) for each in data.variants
    }
    for each, labels in zip(data.variants, data.springs, strict=True):
        found = models[each.springs].parameter_names
        if found != labels.names:
            raise CodecError(
                f"variant {each.name!r} was made with {len(labels.names)} springs;"
                f" {each.springs!r} now has {len(found)}, or others"
            )
    campaign = make_campaign(list(models.values()), readings, data.options, marker_offset)
    contact = campaign.contact
    if contact.shape != data.contact.shape or not np.all(np.abs(contact - data.contact) <= _SAME):
        raise CodecError(
            f"the readings are not those of the codec: they have {len(contact)} poses, the codec"
            f" {len(data.contact)}, or poses lie elsewhere"
        )
    return tuple(
        Trainee.of(each, models[each.springs], campaign, marker_offset) for each in data.variants
    )
