use proptest::prelude::*;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::*;
use crate::tui::glyphs::Glyphs;
use crate::tui::paint;
use crate::tui::theme::{Role, Theme};

#[derive(Clone, Copy, PartialEq)]
enum Shown {
    GoTo,
    Poses,
}

impl TabView for Shown {
    const ALL: &'static [(Self, &'static str)] = &[(Self::GoTo, "Go to"), (Self::Poses, "Poses")];
}

fn theme(glyphs: Glyphs) -> Theme {
    Theme { has_colour: true, glyphs }
}

fn curve() -> Vec<(f64, f64)> {
    (10..60).map(|n| (f64::from(n), 4.0 / f64::from(n).sqrt())).collect()
}

fn chart(points: &[(f64, f64)]) -> Chart<'_> {
    let (y_title, x_title) = ("predicted error (mm)", "poses");
    Chart { points, level: Some(0.5), limit: None, end: None, mark: Some(30.0), y_title, x_title, digits: 3 }
}

fn rows() -> Vec<(Role, Vec<String>)> {
    (1..30).map(|n| (Role::Plain, vec![format!("pose {n}"), format!("{:.3}", f64::from(n) / 7.0)])).collect()
}

const COLUMNS: [Column<'static>; 2] = [Column::text("pose", 8), Column::number("error (mm)", 10)];

fn all(glyphs: Glyphs, area: Rect, buf: &mut Buffer) {
    let theme = theme(glyphs);
    let part = |from: u16, rows: u16| paint::band(area, from, rows);
    draw_tabs(theme, Shown::Poses, part(0, 1), buf);
    bar(theme, 0.43, part(1, 1), buf);
    digits::draw("-123.456", glyphs, theme.style(Role::Title), part(2, 3), buf);
    digits::draw("7890", glyphs, theme.style(Role::Title), part(5, 3), buf);
    let rows = rows();
    Table { columns: &COLUMNS, rows: &rows, selected: Some(12), first: 0 }.draw(theme, part(8, 5), buf);
    chart(&curve()).draw(theme, part(13, 9), buf);
}

#[test]
fn all_of_them() {
    for (name, glyphs) in [("unicode", Glyphs::Unicode), ("ascii", Glyphs::Ascii)] {
        let mut buf = Buffer::empty(Rect::new(0, 0, 50, 22));
        let area = buf.area;
        all(glyphs, area, &mut buf);
        insta::assert_snapshot!(name, paint::snapshot(&buf));
    }
}

#[test]
fn numbers_that_are_none_do_no_harm() {
    let mut buf = Buffer::empty(Rect::new(0, 0, 40, 8));
    let area = buf.area;
    let points = [(f64::NAN, 1.0), (1.0, f64::INFINITY), (1.0, 2.0)];
    Chart { level: Some(f64::NAN), limit: Some(f64::NAN), end: Some(f64::NAN), mark: Some(f64::NAN), ..chart(&points) }
        .draw(theme(Glyphs::Unicode), area, &mut buf);
    bar(theme(Glyphs::Unicode), f64::NAN, area, &mut buf);
    assert_eq!(digits::columns("-1.5"), 13);
}

proptest! {
    #[test]
    fn nothing_is_drawn_outside(x in 0_u16..70, y in 0_u16..40, width in 0_u16..90, height in 0_u16..50, ascii: bool) {
        let mut buf = Buffer::empty(Rect::new(0, 0, 60, 30));
        for cell in &mut buf.content {
            cell.set_char('~');
        }
        let area = Rect::new(x, y, width, height);
        all(if ascii { Glyphs::Ascii } else { Glyphs::Unicode }, area, &mut buf);
        for row in 0..30 {
            for column in 0..60 {
                let is_inside = area.contains((column, row).into());
                prop_assert!(is_inside || buf[(column, row)].symbol() == "~", "{column} {row}");
            }
        }
    }
}

#[test]
fn a_limit_brings_zero_ticks_and_the_end_of_the_plan() {
    let mut buf = Buffer::empty(Rect::new(0, 0, 50, 12));
    let area = buf.area;
    let points = curve();
    let chart = Chart { limit: Some(0.8), end: Some(80.0), ..chart(&points) };
    chart.draw(theme(Glyphs::Unicode), area, &mut buf);
    let shown = paint::snapshot(&buf);
    for label in ["\n0.000", "1.265", " 80"] {
        assert!(shown.contains(label), "no '{label}' in\n{shown}");
    }
    assert!(shown.lines().filter(|line| line.contains("0.")).count() >= 3, "no ticks in\n{shown}");
    // The dashes of the limit are between the ticks that enclose it.
    let dashes = shown.lines().position(|line| line.matches('⠤').count() > 20).unwrap();
    assert!((1..5).contains(&dashes), "{shown}");
}
