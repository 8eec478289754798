// How many workgroups it takes for what the device counts: arguments of indirect dispatches.
import package::common::numeric::MAX_GROUPS;

// Elements of a workgroup of the kernels that give a thread to each, of a scan and of a sort.
const THREADS: u32 = 256u;
const SCAN_BLOCK: u32 = 1024u;
const SORT_BLOCK: u32 = 2048u;

// Digits that a sort counts in each of its blocks.
const DIGITS: u32 = 256u;

// Where a sort's stand in the list of `groups_for_count`; `Work` in src/raster/groups.rs names all.
const OF_SORT: u32 = 2u;

struct Groups {
    // Along x, y, z.
    counts: vec3u,
    // Elements that they work on.
    length: u32,
}

fn blocks(length: u32, each: u32) -> u32 {
    return (length + each - 1u) / each;
}

fn groups_for(length: u32, each: u32) -> Groups {
    let groups = blocks(length, each);
    return Groups(vec3u(min(groups, MAX_GROUPS), blocks(groups, MAX_GROUPS), 1u), length);
}

// For so many elements: a thread each, to scan them, to sort them, and to scan the sort's
// histogram `[DIGITS, blocks]`.
fn groups_for_count(count: u32) -> array<Groups, 4> {
    let histogram = DIGITS * blocks(count, SORT_BLOCK);
    return array<Groups, 4>(
        groups_for(count, THREADS),
        groups_for(count, SCAN_BLOCK),
        groups_for(count, SORT_BLOCK),
        groups_for(histogram, SCAN_BLOCK),
    );
}
