"""The motion of a contact as sound."""

from __future__ import annotations

import io
import wave

import numpy as np

from stickslip.faults import InputError
from stickslip.scene.contact import contact_index
from stickslip.transient.trajectory import Trajectory

#: Samples a second, and how many times as many are taken before what cannot be heard is filtered out.
RATE, FINER = 44_100, 2
#: Largest amplitude, of what 16 bits hold, and s over which the sound begins and ends softly.
LOUD, SOFT = 0.8, 0.01


def sound(run: Trajectory, contact: int | str = 0) -> bytes:
    """Return the tangential velocity of a contact as a WAV file, 16 bits, one channel, at its own speed.

    The motion is sampled more finely than the file and filtered, so that the corners of its velocity are not
    aliased into audible tones. You hear the velocity of the contact itself, without the path of the sound
    through structure and air; its loudness has no meaning.
    """
    from scipy.signal import resample_poly

    place = contact_index("contact", contact, run.scene.contacts)
    samples = int(run.duration * RATE) * FINER
    if samples < 2 * FINER:
        raise InputError(f"run: {run.duration:g} s are too short to be heard")
    times = np.arange(samples) / (RATE * FINER)
    direction = run.scene.tangential_direction(place)
    # A dof is all that is kept of the samples of many.
    velocity = np.concatenate(
        [run.core.sample(part)[1] @ direction for part in np.array_split(times, -(-samples // 2**15))]
    )
    heard = resample_poly(velocity - velocity.mean(), 1, FINER)
    soft = np.minimum(1.0, np.arange(heard.size) / (SOFT * RATE))
    heard *= soft * soft[::-1]
    largest = float(np.abs(heard).max()) or 1.0
    stream = io.BytesIO()
    with wave.open(stream, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes((heard * (LOUD * 32767.0 / largest)).astype("<i2").tobytes())
    return stream.getvalue()
