"""Scenarios and their frames."""

from __future__ import annotations

import json
import os
import pathlib
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, SupportsIndex, overload

from . import _camsim, _toml
from ._errors import InputError, ScenarioWarning, in_users_words, name_path
from .frame import Frame
from .frames import Frames, channel_names, frame_number
from .inputs import InputFiles
from .keys import Keys
from .lens import Lens
from .randomize import Variations
from .trajectory import BarometerSamples, GnssSamples, ImuSamples, MagnetometerSamples, Trajectory

Path = str | os.PathLike[str]


class Scenario(Sequence[Frame]):
    """A flight through a scene as one camera sees it: a sequence of frames that are rendered when asked for.

    >>> import camsim
    >>> scenario = camsim.Scenario.load("assets/demo.toml")
    >>> len(scenario)
    120
    >>> scenario[7].save("frame-7.png")
    >>> for frame in scenario.frames(0, 10, channels=["color", "depth"]):
    ...     print(frame.index, frame.stamp_ns, float(frame.depth.max()))
    """

    def __init__(self, native: _camsim.Scenario = None, files: InputFiles = None, known: Iterable[str] = ()) -> None:  # type: ignore[assignment]
        """Not for users: `Scenario.load` and `Scenario.from_dict` make scenarios."""
        if not isinstance(native, _camsim.Scenario):
            raise TypeError("use Scenario.load(path), Scenario.from_dict(tree) or Scenario.demo() to make a scenario")
        self._native = native
        self._files = files
        known = set(known)
        self._twin_of: tuple[Scenario, str, int | None] | None = None
        for warning in self.warnings:
            if warning not in known:
                warnings.warn(warning, ScenarioWarning, stacklevel=3)

    @classmethod
    def load(
        cls,
        path: Path,
        *,
        sets: Keys | Mapping[str, Any] | None = None,
        camera: str | None = None,
        preset: str | None = None,
        backend: str = "auto",
    ) -> Scenario:
        """Reads a scenario (TOML) or the `run.json` of an earlier run, and every file that it names.

        :param path: The file.
        :param sets: Keys with values on top of the file's, as `--set` of the command line.
        :param camera: Name of one of `[[cameras]]`; the first if omitted.
        :param preset: ``"default"`` or ``"paper"``.
        :param backend: ``"cpu"``, ``"gpu"``, ``"reference"`` (exact rays in double precision, slowly), or ``"auto"``: the
            gpu on a graphics card, else the cpu, and the reference renderer if `quality.solver` is ``"reference"``.
        :raises camsim.InputError: The message names the file, line or key and what to do.

        >>> scenario = Scenario.load("flight.toml", sets={"camera.shutter.readout_ms": 0})
        """
        if isinstance(path, Mapping):
            raise TypeError("load takes the path of a file; Scenario.from_dict takes a dict of keys")
        files = InputFiles()
        return cls(_camsim.Scenario.load(path, _set_pairs(sets or {}, files), preset, camera, backend), files)

    @classmethod
    def from_dict(
        cls,
        tree: Mapping[str, Any],
        *,
        folder: Path = ".",
        camera: str | None = None,
        backend: str = "auto",
    ) -> Scenario:
        """A scenario from a tree of keys, as `to_dict` gives it.

        :param tree: Tables, lists, numbers and text; what is omitted has its default. Instead of paths there may be
            a `PoseTable` (log), a `HeightMap` (DEM), and pictures as arrays of bytes.
        :param folder: The folder that relative paths are in.

        >>> scenario = Scenario.from_dict({
        ...     "flight": {"log": "flight.csv"},
        ...     "camera": {"size_px": [640, 480], "focal_px": [420.0, 420.0], "fps": 30.0},
        ...     "scene": {"pattern": {"image": "ground.png", "width_m": 100.0}},
        ... })
        """
        if not isinstance(tree, Mapping):
            hint = "; Scenario.load reads files" if isinstance(tree, (str, os.PathLike)) else ""
            raise TypeError(f"from_dict takes a dict of keys, not {type(tree).__name__}{hint}")
        files = InputFiles()
        text = _toml.document_text(files.placed(tree))
        return cls(_camsim.Scenario.parse(text, pathlib.Path(folder) / "<dict>", camera, backend), files)

    @classmethod
    def demo(cls, *, backend: str = "auto") -> Scenario:
        """The built-in flight over a valley, which needs no file.

        >>> Scenario.demo()[7].save("first.png")
        """
        files = InputFiles()
        path = _camsim.unpack_demo(files.folder)
        name_path(str(path), "Scenario.demo()")
        return cls(_camsim.Scenario.load(path, [], None, None, backend), files)

    def to_dict(self) -> dict[str, Any]:
        """Every key with its value, those of defaults too. Times are as in the file (s, ms), angles in degrees."""
        tree: dict[str, Any] = json.loads(self._native.json(False))
        return tree

    def to_toml(self) -> str:
        """Every key with its value as the text of a scenario file."""
        return self._native.toml()

    def set(self, key: str, value: Any) -> None:
        """Changes a key of this scenario. Frames under way are not changed.

        :param key: With dots, as in the file; elements of lists by number, or by name where they have one.
        :param value: Of a table the keys that change: the others of the table stay. Lists and values are replaced.
            None takes a key or a whole table out, so that its default holds.
        :raises camsim.InputError: There is no such key, or the value cannot be used; nothing is changed then.

        >>> scenario.set("camera.shutter.readout_ms", 20)
        """
        native = self._native.changed(_set_pairs({key: value}, self._files))
        self._native.take(native)

    def replace(self, sets: Keys | Mapping[str, Any]) -> Scenario:
        """A copy with changed keys. What they do not touch (log, scene) is shared, and loaded once.

        Tables are merged key by key, so ``{"camera": {"fps": 10}}`` is ``{"camera.fps": 10}`` and leaves the rest of
        the camera as it is; lists and values are replaced. None takes a key or a whole table out:
        ``{"camera.sensor": None}`` is a camera without one.

        >>> sharp = scenario.replace({"camera.shutter.exposure_ms": 0, "camera.shutter.readout_ms": 0})
        """
        return Scenario(self._native.changed(_set_pairs(sets, self._files)), self._files, self.warnings)

    @property
    def variations(self) -> Variations:
        """The scenarios that `[randomize]` of the file describes; `camsim.randomize` adds one."""
        return Variations(self)

    @property
    def variation(self) -> int | None:
        """Number of the variation that it is; None if nothing was drawn."""
        return self._native.variation_index

    @property
    def drawn(self) -> dict[str, Any]:
        """What was drawn for this variation, by key."""
        index = self.variation
        return {} if index is None else dict(json.loads(self._native.drawn(index)))

    def _variation(self, index: int) -> Scenario:
        return Scenario(self._native.variation(index), self._files, self.warnings)

    @property
    def camera(self) -> str:
        """Name of the camera; empty where it has none."""
        return self._native.camera

    @property
    def cameras(self) -> dict[str, Scenario]:
        """The scenarios of all cameras of `[[cameras]]` by their names, of one flight and scene.

        >>> left, right = scenario.cameras["left"], scenario.cameras["right"]
        """
        known = self.warnings
        return {name: Scenario(self._native.of_camera(name), self._files, known) for name in self._native.cameras}

    @property
    def twins(self) -> dict[str, int]:
        """Names of the twins of `[[output.twin]]`, with the number of their pictures of each frame."""
        return {spec["name"]: spec.get("instants") or 1 for spec in self._twin_specs()}

    def twin(self, name: str, instant: int | None = None) -> Scenario:
        """The scenario whose frames are a twin's pictures: a camera without what `[[output.twin]]` leaves out.

        :param name: As in the file.
        :param instant: Number of the picture, from 0, if the twin is a burst.

        >>> sharp = scenario.twin("sharp")
        >>> scenario[7].color - sharp[7].color
        """
        twin = Scenario(self._native.twin(name, instant), self._files, self.warnings)
        twin._twin_of = (self, name, instant)
        return twin

    def _twin_specs(self) -> list[dict[str, Any]]:
        return list(self.to_dict()["output"].get("twin", []))

    @property
    def channels(self) -> list[str]:
        """The channels of `output.channels`, which frames have if nothing else is asked for."""
        return self._native.channels

    @property
    def warnings(self) -> list[str]:
        """What looks like a mistake in the scenario, and what camsim reads otherwise than it is written."""
        return [in_users_words(warning) for warning in self._native.warnings()]

    @property
    def objects(self) -> list[tuple[str, int]]:
        """Name and class of every object; number n of the channel `object` is `objects[n - 1]`."""
        return self._native.objects()

    @property
    def lens(self) -> Lens:
        """The camera's lens."""
        return Lens._of(self._native.camera_keys().lens())

    @property
    def trajectory(self) -> Trajectory:
        """Motion of platform and camera at any instant."""
        return Trajectory(self._native.trajectory())

    def imu(self, name: str | None = None) -> ImuSamples:
        """Samples of an `[[imu]]`; of several it is named.

        >>> imu = scenario.imu()
        >>> imu.t_ns, imu.gyro_rad_s, imu.accel_m_s2
        """
        return ImuSamples(**self._native.samples("imu", name))

    def gnss(self, name: str | None = None) -> GnssSamples:
        """Samples of a `[[gnss]]`."""
        return GnssSamples(**self._native.samples("gnss", name))

    def barometer(self, name: str | None = None) -> BarometerSamples:
        """Samples of a `[[barometer]]`."""
        return BarometerSamples(**self._native.samples("barometer", name))

    def magnetometer(self, name: str | None = None) -> MagnetometerSamples:
        """Samples of a `[[magnetometer]]`."""
        return MagnetometerSamples(**self._native.samples("magnetometer", name))

    def __reduce__(self) -> tuple[Any, ...]:
        """Scenarios travel to other processes with their keys and arrays; what they load is loaded there."""
        if self._twin_of is not None:
            return Scenario.twin, self._twin_of
        camera = self.camera if len(self._native.cameras) > 1 else None
        folder = str(self._files.folder) if self._files.contents() else ""
        return _restored, (self._native.json(True), camera, self._native.backend, folder, self._files.contents())

    def __len__(self) -> int:
        """Number of frames in the window."""
        return len(self._native)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        """Renders one frame, or those of a slice, with the channels of `output.channels`."""
        if isinstance(index, slice):
            return list(self._frames(self._numbers(index), None))
        return self.render(index)

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def render(self, index: int, channels: Iterable[str] | None = None) -> Frame:
        """Renders one frame. Several in order are faster by `frames`.

        :param index: Number of the frame; negative from the end.
        :param channels: Names as in `docs/reference/CHANNELS.md`; those of `output.channels` if omitted.
        :raises IndexError: There is no such frame.
        """
        number = self._number(index)
        native = self._native
        return Frame(native.render_one(number, channel_names(channels)), native.camera, native.encoding)

    def frames(
        self,
        start: int | None = None,
        stop: int | None = None,
        step: int | None = None,
        *,
        channels: Iterable[str] | None = None,
        twins: bool = False,
        progress: bool = False,
    ) -> Frames:
        """Renders frames in order; while Python works on one, the next ones are under way.

        :param start, stop, step: As those of a slice of this scenario.
        :param channels: Names as in `docs/reference/CHANNELS.md`; those of `output.channels` if omitted.
        :param twins: Render the twins of each frame too, with the channels of `[[output.twin]]` or those of the frame;
            `Frame.twin` gives them.
        :param progress: Show a bar by tqdm, if that is installed.

        >>> for frame in scenario.frames(0, 100, channels=["color", "flow"]):
        ...     train(frame.color, frame.flow)
        """
        frames = self._frames(self._numbers(slice(start, stop, step)), channel_names(channels), twins)
        return frames._with_bar() if progress else frames

    def _number(self, index: SupportsIndex) -> int:
        """The number of a frame, which may be counted from the end."""
        return frame_number(index, len(self))

    def _numbers(self, wanted: slice) -> range:
        try:
            return range(len(self))[wanted]
        except TypeError:
            raise TypeError("start, stop and step are whole numbers of frames, or None") from None

    def _frames(self, numbers: range, channels: list[str] | None, twins: bool = False) -> Frames:
        return Frames(self._native, numbers, channels, self._twin_specs() if twins else [])

    def explain(self, frame: int = 0, *, as_dict: bool = False) -> Any:
        """The plan of a frame: passes, sizes, samples, predicted errors, what is skipped and why.

        :param as_dict: Give what `camsim explain --json` prints; else the text for people.

        >>> print(scenario.explain(7))
        >>> scenario.explain(7, as_dict=True)["plan"]
        """
        text = self._native.explain(self._number(frame), as_dict)
        return json.loads(text) if as_dict else text

    def __repr__(self) -> str:
        camera = f" of {self.camera}" if self.camera else ""
        return f"<camsim.Scenario{camera}: {len(self)} frames, {', '.join(self.channels)}>"

    # Two scenarios are not compared frame by frame.
    __eq__ = object.__eq__
    __hash__ = object.__hash__


def load_rig(path: Path, *, sets: Keys | Mapping[str, Any] | None = None, backend: str = "auto") -> dict[str, Scenario]:
    """The scenarios of all cameras of a file with `[[cameras]]`, by name; log and scene are read once.

    >>> rig = camsim.load_rig("stereo.toml")
    >>> for left, right in zip(rig["left"].frames(), rig["right"].frames()):
    ...     ...
    """
    return Scenario.load(path, sets=sets, backend=backend).cameras


def default_scenario() -> str:
    """Every key of a scenario file with its default, unit and meaning, as TOML."""
    return _camsim.default_scenario()


def _set_pairs(sets: Keys | Mapping[str, Any], files: InputFiles) -> list[tuple[str, str]]:
    if not isinstance(sets, Mapping):
        raise TypeError(f'sets: a dict is needed, {{"camera.fps": 10}}, not {type(sets).__name__}')
    pairs: list[tuple[str, str]] = []
    for key, value in sets.items():
        if not isinstance(key, str):
            raise TypeError(f"keys of a scenario are text, not {type(key).__name__}: {key!r}")
        _add_pairs(pairs, key, value, files)
    return pairs


def _add_pairs(pairs: list[tuple[str, str]], key: str, value: Any, files: InputFiles) -> None:
    """Adds what `--set` says for a value: of a table each of its keys, so that its others stay."""
    is_law = key.startswith("randomize.")
    if value is None and key == "randomize":
        raise InputError("randomize: take its keys out one by one, {\"randomize.camera.fps\": None}, or use a scenario without it")
    if value is None:
        pairs.append((key, _camsim.UNSET))
    elif isinstance(value, Mapping) and value and not is_law:
        for name, item in value.items():
            _toml.key_text(name)
            _add_pairs(pairs, f"{key}.{name}", item, files)
    else:
        pairs.append((key, files.text(value, key)))


def _restored(text: str, camera: str | None, backend: str, folder: str, contents: Mapping[str, bytes]) -> Scenario:
    files = InputFiles(contents)
    if contents:
        text = text.replace(json.dumps(folder)[1:-1], json.dumps(str(files.folder))[1:-1])
    document = _toml.document_text(json.loads(text))
    native = _camsim.Scenario.parse(document, pathlib.Path("scenario"), camera, backend)
    return Scenario(native, files, known=map(in_users_words, native.warnings()))
