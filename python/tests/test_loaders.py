"""Samples in workers of PyTorch and in actors of Ray: the bytes of one process."""

from __future__ import annotations

import multiprocessing
import pathlib
import threading
import time
from typing import Any

import camsim
import numpy as np
import pytest
from conftest import SMALL

COUNT = 12
CHANNELS = ["color", "depth", "object"]


def variations(pattern: pathlib.Path) -> camsim.Variations:
    """Of the built-in flight, with a picture each."""
    sets = {**SMALL, "camera.photometric.noise_sigma": 0.01, "flight.window_s": [0, 2]}
    scenario = camsim.Scenario.load(pattern, sets=sets, backend="cpu")
    laws = {
        "camera.shutter.exposure_ms": camsim.Uniform(0, 10),
        "camera.mount.angles_deg": camsim.Normal([0, -90, 0], [2, 2, 90], clip=(-360, 360)),
        "flight.window_s": camsim.Piece(0.03),
    }
    return camsim.randomize(scenario, laws, seed=3, count=COUNT)


def _rendered(pattern: pathlib.Path, sending: Any) -> None:
    from camsim._samples import Samples

    samples = Samples(variations(pattern), CHANNELS, None)
    sending.send([samples[index] for index in range(COUNT)])


@pytest.fixture(scope="module")
def rendered() -> list[dict[str, Any]]:
    """All samples, by a process of its own: this one must not have rendered before it forks."""
    pattern = pathlib.Path(__file__).resolve().parents[2] / "assets" / "pattern.toml"
    context = multiprocessing.get_context("spawn")
    receiving, sending = context.Pipe(duplex=False)
    process = context.Process(target=_rendered, args=(pattern, sending))
    process.start()
    samples: list[dict[str, Any]] = receiving.recv()
    process.join()
    return samples


def test_a_wrong_channel_is_refused_before_the_first_sample(pattern: pathlib.Path) -> None:
    from camsim._samples import Samples

    with pytest.raises(camsim.InputError, match="colour"):
        Samples(camsim.Scenario.load(pattern), ["colour"], None)


@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_two_workers_give_the_bytes_of_one_process(
    context: str, pattern: pathlib.Path, rendered: list[dict[str, Any]]
) -> None:
    pytest.importorskip("torch")
    import camsim.torch
    import torch

    dataset = camsim.torch.Dataset(variations(pattern), channels=CHANNELS)
    assert len(dataset) == COUNT
    loader = torch.utils.data.DataLoader(
        dataset, batch_size=3, shuffle=True, num_workers=2, multiprocessing_context=context
    )
    seen = []
    for batch in loader:
        assert batch["color"].shape == (3, 4, 120, 160) and batch["object"].dtype == torch.int32
        for index, number in enumerate(batch["sample"].tolist()):
            seen.append(number)
            wanted = rendered[number]
            assert np.array_equal(batch["color"][index].permute(1, 2, 0).numpy(), wanted["color"])
            assert np.array_equal(batch["depth"][index].numpy(), wanted["depth"])
            assert np.array_equal(batch["object"][index].numpy(), wanted["object"])
            exposure = batch["drawn"]["camera.shutter.exposure_ms"][index].item()
            assert exposure == wanted["drawn"]["camera.shutter.exposure_ms"]
    assert sorted(seen) == list(range(COUNT))


def slow_samples(pattern: pathlib.Path, marks: pathlib.Path) -> Any:
    """Samples that take a second, and leave a file with the node's name for each."""
    from camsim._samples import Samples

    class Slow(Samples):
        def __getitem__(self, index: Any) -> dict[str, Any]:
            import ray

            node = ray.get_runtime_context().get_node_id()
            (marks / f"{node}-{int(index)}").touch()
            time.sleep(1)
            return super().__getitem__(index)

    return Slow(variations(pattern), CHANNELS, None)


def test_a_killed_node_changes_no_byte(
    pattern: pathlib.Path, rendered: list[dict[str, Any]], tmp_path: pathlib.Path
) -> None:
    pytest.importorskip("ray.data")
    import camsim.ray
    import ray
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 2, "include_dashboard": False})
    try:
        node = cluster.add_node(num_cpus=2)
        ray.init(address=cluster.address, log_to_driver=False)
        cluster.wait_for_nodes()
        both = threading.Event()

        def kill_when_both_render() -> None:
            while len({mark.name.split("-")[0] for mark in tmp_path.iterdir()}) < 2:
                time.sleep(0.05)
            cluster.remove_node(node, allow_graceful=False)
            both.set()

        killer = threading.Thread(target=kill_when_both_render, daemon=True)
        killer.start()
        frames = camsim.ray._rendered(slow_samples(pattern, tmp_path), 2, 1, 1)
        rows, late = [], 0
        for row in frames.iter_rows():
            rows.append(row)
            late += both.is_set()
        assert late > 0, "the node was killed on the way"
        assert sorted(int(row["sample"]) for row in rows) == list(range(COUNT))
        # What the lost node had begun was rendered again.
        assert len(list(tmp_path.iterdir())) > COUNT
        for row in rows:
            wanted = rendered[int(row["sample"])]
            for channel in CHANNELS:
                assert np.array_equal(row[channel], wanted[channel]), channel
            assert row["camera.shutter.exposure_ms"] == wanted["drawn"]["camera.shutter.exposure_ms"]
    finally:
        ray.shutdown()
        cluster.shutdown()
