// Size of indirect dispatches: workgroups along x, then rows of MAX_GROUPS_X. Every adapter allows 65535
// along each axis.
const MAX_GROUPS_X: u32 = 32768u;
