"""Pictures of a real, imperfect airborne camera, and the truth about them.

>>> import camsim
>>> scenario = camsim.Scenario.load("flight.toml")
>>> for frame in scenario.frames(0, 10, channels=["color", "depth"]):
...     print(frame.index, frame.stamp_ns, frame.color.shape, float(frame.depth.max()))

World: local north-east-down, metres. Camera: right, down, forwards, as OpenCV; pixel (0, 0) is the centre of the
top-left pixel. Quaternions are scalar first. `docs/guide/PYTHON.md` is the page of this package.
"""

from __future__ import annotations

import atexit as _atexit
import os as _os

# Mesa's device-selection layer prints an error for each adapter where there is no desktop session to ask.
if "XDG_RUNTIME_DIR" not in _os.environ:
    _os.environ.setdefault("NODEVICE_SELECT", "1")

from . import _camsim
from ._errors import AdapterError, Error, InputError, RunError, ScenarioWarning
from .frame import Frame, Pose, Rows, Source
from .frames import Frames
from .inputs import HeightMap, PoseTable
from .keys import Keys
from .lens import Lens
from .pictures import Applied, Board, Comparison, Flow, Poses, Twist, apply, board, compare, verify
from .randomize import (
    Choice,
    Distribution,
    Integer,
    LogUniform,
    Normal,
    Piece,
    Plus,
    Times,
    Uniform,
    Variations,
    randomize,
)
from .scenario import Scenario, default_scenario, load_rig
from .trajectory import (
    BarometerSamples,
    BodyStates,
    CameraStates,
    GnssSamples,
    ImuSamples,
    MagnetometerSamples,
    Trajectory,
)

__version__ = _camsim.__version__

__all__ = [
    "AdapterError",
    "Applied",
    "BarometerSamples",
    "Board",
    "BodyStates",
    "CameraStates",
    "Choice",
    "Comparison",
    "Distribution",
    "Error",
    "Flow",
    "Frame",
    "Frames",
    "GnssSamples",
    "HeightMap",
    "ImuSamples",
    "InputError",
    "Integer",
    "Keys",
    "Lens",
    "LogUniform",
    "Normal",
    "Piece",
    "Plus",
    "MagnetometerSamples",
    "PoseTable",
    "Pose",
    "Poses",
    "Rows",
    "RunError",
    "Scenario",
    "ScenarioWarning",
    "Source",
    "Times",
    "Trajectory",
    "Twist",
    "Uniform",
    "Variations",
    "apply",
    "board",
    "compare",
    "default_scenario",
    "load_rig",
    "randomize",
    "verify",
]

# Threads that render must end before drivers are unloaded.
_atexit.register(_camsim.stop_streams)
