//! Small things that several screens draw: table, bar, chart, large digits, tabs. They keep nothing and draw into their area only.

pub mod bar;
pub mod chart;
pub mod digits;
pub mod table;
pub mod tabs;

pub use bar::bar;
pub use chart::Chart;
pub use table::{Column, Table};
pub use tabs::tabs;

#[cfg(test)]
mod tests;
