//! Scenes and motions that experiments run on: made in memory, from fixed seeds.
