"""Dense flow by dense inverse search (OpenCV's DIS) against the exact flow, at pixels that the next picture shows."""

import cv2
import numpy as np
from common import pairs_with_flow, spread, write

method = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
errors, lengths = [], []
for one, other, true, valid in pairs_with_flow():
    found = method.calc(one, other, None)
    errors.append(np.linalg.norm(found - true, axis=2)[valid])
    lengths.append(np.linalg.norm(true, axis=2)[valid])
errors, lengths = (np.concatenate(part) if part else np.array([]) for part in (errors, lengths))
write(**spread("error", errors, "px"), flow_median_px=np.median(lengths) if len(lengths) else np.nan)
