//! The look of the screens. All other modules use roles, never colours.
//!
//! Only the 16 colours of the terminal's own palette are used, so that light and dark terminals both work. Without colour the same
//! roles differ by bold, dim, underlined and reversed. Colour never carries a meaning alone: a word or symbol goes with it.

use ratatui::style::{Color, Modifier, Style};

use super::glyphs::Glyphs;

/// Role of a piece of text.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Ordinary text.
    #[default]
    Plain,
    /// Good state.
    Ok,
    /// Needs attention.
    Warn,
    /// Stops the procedure.
    Alarm,
    /// What to do next.
    Hint,
    /// Secondary text.
    Dim,
    /// The element that the next key acts on.
    Focus,
    /// Heading.
    Title,
    /// The nominal arm and its errors.
    Nominal,
    /// The identified arm and its errors.
    Identified,
}

/// Styles and glyphs. Decided once, from command line and environment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Theme {
    pub has_colour: bool,
    pub glyphs: Glyphs,
}

impl Theme {
    /// The style of a role.
    pub const fn style(self, role: Role) -> Style {
        let plain = Style::new();
        let (colour, modifier) = match role {
            Role::Plain => return plain,
            Role::Ok => (Some(Color::Green), Modifier::empty()),
            Role::Warn => (Some(Color::Magenta), Modifier::BOLD),
            Role::Alarm => (Some(Color::Red), Modifier::BOLD.union(Modifier::REVERSED)),
            Role::Hint => (Some(Color::Cyan), Modifier::empty()),
            Role::Dim => (None, Modifier::DIM),
            Role::Focus => (None, Modifier::REVERSED),
            Role::Title => (None, Modifier::BOLD),
            // The yellow of most palettes is the nearest to orange.
            Role::Nominal => (Some(Color::Yellow), Modifier::empty()),
            Role::Identified => (Some(Color::LightBlue), Modifier::empty()),
        };
        let modifier = match role {
            // Without colour the underline marks a hint.
            Role::Hint if !self.has_colour => Modifier::UNDERLINED,
            Role::Nominal if !self.has_colour => Modifier::DIM,
            _ => modifier,
        };
        match colour {
            Some(colour) if self.has_colour => plain.fg(colour).add_modifier(modifier),
            _ => plain.add_modifier(modifier),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROLES: [Role; 10] = [
        Role::Plain,
        Role::Ok,
        Role::Warn,
        Role::Alarm,
        Role::Hint,
        Role::Dim,
        Role::Focus,
        Role::Title,
        Role::Nominal,
        Role::Identified,
    ];

    #[test]
    fn without_colour_no_style_has_one() {
        let theme = Theme { has_colour: false, glyphs: Glyphs::Ascii };
        for role in ROLES {
            let style = theme.style(role);
            assert_eq!((style.fg, style.bg), (None, None), "{role:?}");
        }
    }

    #[test]
    fn with_colour_roles_differ() {
        let theme = Theme { has_colour: true, glyphs: Glyphs::Unicode };
        for (index, a) in ROLES.iter().enumerate() {
            for b in &ROLES[index + 1..] {
                assert_ne!(theme.style(*a), theme.style(*b), "{a:?} {b:?}");
            }
        }
        assert!(theme.style(Role::Alarm).add_modifier.contains(Modifier::REVERSED));
    }
}
