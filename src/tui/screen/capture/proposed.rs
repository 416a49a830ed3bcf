//! Points that are shown before they are taken, each with what the checks say about it.

use crate::text::shortened;
use crate::tui::screen::page::Page;
use crate::tui::theme::{Role, Theme};
use crate::wizard::view::{ProposedState, ProposedView};

/// Columns of the name of a point.
const NAME: usize = 10;

/// The page with all points.
pub(super) fn page(theme: Theme, proposed: &ProposedView, columns: u16) -> Page {
    let mut page = Page::new(theme, columns);
    page.title(&format!("Points of {}: nothing is taken yet", proposed.source));
    let head = format!("{:<9} {:<NAME$} {:>11} {:>11} {:>11}  {}", "pose", "point", "x mm", "y mm", "z mm", "");
    page.line(vec![(head, Role::Dim)]);
    for point in &proposed.points {
        let [x, y, z] = point.xyz_mm;
        let role = match point.state {
            ProposedState::Fits => Role::Ok,
            ProposedState::InQuestion | ProposedState::Impossible => Role::Warn,
        };
        let pose = point.pose.as_deref().unwrap_or("-");
        let name = shortened(point.name.as_deref().unwrap_or(""), NAME);
        let line = format!("{pose:<9} {name:<NAME$} {x:>11.3} {y:>11.3} {z:>11.3}  ");
        page.line(vec![(line, Role::Plain), (point.state.words().to_owned(), role)]);
        if let Some(message) = &point.message {
            page.marked(("  ", Role::Plain), message, role);
        }
    }
    page
}
