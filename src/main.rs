//! The `trupose` program.
fn main() {}
