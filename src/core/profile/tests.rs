//! Shipped profiles: they parse, they are RON, their kinematics are those of the maker's drawing.

mod drawings;
mod shipped;
mod values;
