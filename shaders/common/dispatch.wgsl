// Dispatches whose size a shader finds: workgroups along x, then in rows of MOST_GROUPS. Every adapter has
// 65535 along each axis.
const MOST_GROUPS: u32 = 32768u;
