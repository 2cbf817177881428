"""Shi-Tomasi corners, tracked by pyramidal Lucas-Kanade (OpenCV) to the next picture, against the exact flow at them."""

import cv2
import numpy as np
from common import pairs_with_flow, spread, write

LOST_PX = 3.0

errors, lost = [], []
for one, other, true, valid in pairs_with_flow():
    # Away from borders of what the next picture shows, where the flow at a corner is read from four pixels.
    inside = cv2.erode(valid.astype(np.uint8), np.ones((5, 5), np.uint8))
    corners = cv2.goodFeaturesToTrack(one, 500, 0.01, 8, mask=inside)
    if corners is None:
        continue
    found, status, _ = cv2.calcOpticalFlowPyrLK(one, other, corners, None, winSize=(21, 21), maxLevel=4)
    exact = cv2.remap(true, corners, None, cv2.INTER_LINEAR)
    error = np.linalg.norm(found - corners - exact, axis=2).ravel()
    is_lost = (status.ravel() == 0) | ~(error < LOST_PX)
    errors.extend(error[~is_lost])
    lost.extend(is_lost)
write(**spread("error", errors, "px"), lost=np.mean(lost) if lost else np.nan, corners=len(lost))
