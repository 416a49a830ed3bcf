//! Widgets of several screens: table, bar, chart, large digits, tabs. They are stateless and draw into their area only.

pub mod bar;
pub mod chart;
pub mod digits;
pub mod table;
pub mod tabs;

pub use bar::bar;
pub use chart::Chart;
pub use table::{Column, Table};
pub use tabs::{TabView, draw_tabs};

#[cfg(test)]
mod tests;
