// The tiles that a dispatch takes: from the first on, as many as it has workgroups.
struct Portion {
    first: u32,
}
