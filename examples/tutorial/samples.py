"""Random scenarios as batches of tensors: two samples a batch, rendered by two workers.

pip install '.[torch]' in the clone; python samples.py [RANDOM.toml]
"""

import sys

import torch

import camsim
import camsim.torch


def main() -> None:
    scenario = camsim.Scenario.load(sys.argv[1] if sys.argv[1:] else "examples/tutorial/random.toml")
    variations = scenario.variations
    dataset = camsim.torch.Dataset(variations, channels=["color", "depth", "flow"])
    print(f"{len(dataset)} samples; variation 0 has {variations.drawn(0)}")
    loader = torch.utils.data.DataLoader(
        dataset, batch_size=2, shuffle=True, num_workers=2, multiprocessing_context="spawn"
    )
    for batch in loader:
        readouts_ms = ", ".join(f"{readout_ms:.1f}" for readout_ms in batch["drawn"]["camera.shutter.readout_ms"])
        print(f"variations {batch['variation'].tolist()} with readouts of {readouts_ms} ms")
        for channel in ("color", "depth", "flow"):
            print(f"  {channel}: {batch[channel].dtype}, {tuple(batch[channel].shape)}")


if __name__ == "__main__":
    main()
