//! The picture of the robot in its cell, drawn with characters.
//!
//! ```text
//! Scene (base frame, m) ──► Camera ──► View ──► Raster (dots with depth) ──► cells: braille, half blocks or ASCII
//! ```
//!
//! Near objects hide far ones. Solids are shaded and outlined, far lines are dotted, so that the picture can be read without
//! colour. Only the [`Camera`] has state; drawing the same scene twice gives the same characters.

mod camera;
mod cells;
mod draw;
mod raster;
mod scene;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::widgets::Widget;

pub use camera::{Camera, Framing, Projection};
pub use scene::{ArmStyle, Beam, Body, DrawnArm, ErrorVector, ErrorsOf, Mark, MarkKind, Scene, VerifiedPoint};

use super::keymap::Key;
use super::paint;
use super::theme::{Role, Theme};
use crate::units::DEGREE;
use raster::{Material, Raster};

/// Step of the arrow keys (rad).
const ORBIT: f64 = 10.0 * DEGREE;
const ZOOM: f64 = 1.2;
const PAN: f64 = 0.08;

/// The keys of the preview with their effects, for footer and help.
pub const KEYS: [(Key, &str); 13] = [
    (Key::plain_code(crossterm::event::KeyCode::Left), "turn left"),
    (Key::plain_code(crossterm::event::KeyCode::Right), "turn right"),
    (Key::plain_code(crossterm::event::KeyCode::Up), "look from higher"),
    (Key::plain_code(crossterm::event::KeyCode::Down), "look from lower"),
    (Key::char('+'), "zoom in"),
    (Key::char('-'), "zoom out"),
    (Key::char('H'), "move the picture left"),
    (Key::char('L'), "move the picture right"),
    (Key::char('K'), "move the picture up"),
    (Key::char('J'), "move the picture down"),
    (Key::char('v'), "view: arm, all, reflector"),
    (Key::char('o'), "perspective or parallel"),
    (Key::char('0'), "reset the view"),
];

impl Camera {
    /// Handles a key. Returns `false` if it is not a key of the preview.
    pub fn on_key(&mut self, key: Key) -> bool {
        use crossterm::event::KeyCode as K;
        match key.code {
            _ if key.has_modifier() => return false,
            K::Left => self.orbit(-ORBIT, 0.0),
            K::Right => self.orbit(ORBIT, 0.0),
            K::Up => self.orbit(0.0, ORBIT),
            K::Down => self.orbit(0.0, -ORBIT),
            K::Char('+' | '=') => self.zoom(ZOOM),
            K::Char('-') => self.zoom(1.0 / ZOOM),
            K::Char('H') => self.pan(-PAN, 0.0),
            K::Char('L') => self.pan(PAN, 0.0),
            K::Char('K') => self.pan(0.0, PAN),
            K::Char('J') => self.pan(0.0, -PAN),
            K::Char('o') => {
                self.projection = match self.projection {
                    Projection::Perspective => Projection::Orthographic,
                    Projection::Orthographic => Projection::Perspective,
                };
            }
            K::Char('v') => {
                self.framing = match self.framing {
                    Framing::Arm => Framing::All,
                    Framing::All => Framing::Reflector,
                    Framing::Reflector => Framing::Arm,
                };
            }
            K::Char('0') => self.reset(),
            _ => return false,
        }
        true
    }
}

/// The picture as a widget.
#[derive(Clone, Copy, Debug)]
pub struct Preview<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub theme: Theme,
}

impl Widget for Preview<'_> {
    fn render(self, area: Rect, buf: &mut Buffer) {
        let area = area.intersection(buf.area);
        if area.is_empty() {
            return;
        }
        let (columns, rows) = (usize::from(area.width), usize::from(area.height));
        let mut raster = Raster::new(columns * 2, rows * 4);
        let labels = draw::scene(self.scene, self.camera, &mut raster);
        for row in 0..area.height {
            for column in 0..area.width {
                let cell = raster.cell(usize::from(column), usize::from(row));
                let Some(shown) = cells::character(cell, self.theme.glyphs) else { continue };
                if let Some(place) = buf.cell_mut((area.x + column, area.y + row)) {
                    place.set_char(shown).set_style(self.theme.style(role(cell.material)));
                }
            }
        }
        for label in labels {
            let text = label.text(self.theme.glyphs);
            let (Ok(column), Ok(row)) = (u16::try_from(label.column), u16::try_from(label.row)) else { continue };
            paint::text(buf, area, (column, row), text, self.theme.style(label.role));
        }
        self.caption(area, buf);
    }
}

impl Preview<'_> {
    /// Draws what the picture itself cannot show.
    fn caption(&self, area: Rect, buf: &mut Buffer) {
        let mut said = Vec::new();
        if !self.scene.errors.is_empty() {
            said.push(format!("errors enlarged {:.0} times", self.scene.exaggeration));
        }
        if self.scene.arms.iter().any(|arm| arm.style == ArmStyle::Dashed) {
            said.push("dashed: identified arm".to_owned());
        }
        if self.scene.magnified > 1.0 {
            said.push(format!("difference enlarged {:.0} times", self.scene.magnified));
        }
        let last = area.height.saturating_sub(1);
        paint::text(buf, area, (0, last), &said.join(", "), self.theme.style(Role::Dim));
    }
}

/// Role of a material.
const fn role(material: Material) -> Role {
    match material {
        Material::Empty | Material::Nominal => Role::Plain,
        Material::Floor | Material::KeepOut | Material::Open => Role::Dim,
        Material::Tracker => Role::Title,
        Material::Identified | Material::IdentifiedError => Role::Identified,
        Material::NominalError => Role::Nominal,
        Material::Beam => Role::Warn,
        Material::Done => Role::Ok,
    }
}

#[cfg(test)]
mod tests;
