//! Work on named threads, for the parts of the program that are pure themselves.

pub mod search;
