// A supersampled ideal frame has `scale` fine pixels along a side of an ideal pixel, with 4 samples each at
// the standard positions (3, 1), (7, 3), (1, 5), (5, 7) eighths of a fine pixel from its top-left corner: one
// per quadrant.
const SAMPLES: i32 = 4;
