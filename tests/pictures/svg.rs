//! A screen of a terminal as SVG. Dots of braille and blocks are drawn, so that no font has to have them.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use vt100::{Cell, Color, Screen};

/// Size of a character.
const WIDTH: f64 = 8.0;
const HEIGHT: f64 = 17.0;
/// Room around the screen.
const EDGE: f64 = 12.0;
const PAPER: &str = "#15191e";
const INK: &str = "#d8dde2";

/// The colour of a cell's character.
fn colour(cell: &Cell) -> &'static str {
    match cell.fgcolor() {
        Color::Idx(1 | 9) => "#ef5f5f",
        Color::Idx(2 | 10) => "#63c174",
        // The nominal arm is orange, the identified one blue.
        Color::Idx(3 | 11) => "#f0a03c",
        Color::Idx(4 | 12) => "#64b0f4",
        Color::Idx(5 | 13) => "#d187e6",
        Color::Idx(6 | 14) => "#52c7cf",
        _ => INK,
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Drawn characters: rectangles of the cell (left, top, width, height as parts of it), or dots of braille.
enum Shape {
    Block([f64; 4], f64),
    Dots(Vec<(f64, f64)>),
}

fn shape(c: char) -> Option<Shape> {
    const DOTS: [(f64, f64); 8] = [
        (0.25, 0.125),
        (0.25, 0.375),
        (0.25, 0.625),
        (0.75, 0.125),
        (0.75, 0.375),
        (0.75, 0.625),
        (0.25, 0.875),
        (0.75, 0.875),
    ];
    Some(match c {
        '█' => Shape::Block([0.0, 0.0, 1.0, 1.0], 1.0),
        '▀' => Shape::Block([0.0, 0.0, 1.0, 0.5], 1.0),
        '▄' => Shape::Block([0.0, 0.5, 1.0, 0.5], 1.0),
        '░' => Shape::Block([0.0, 0.0, 1.0, 1.0], 0.2),
        '─' => Shape::Block([0.0, 0.47, 1.0, 0.06], 1.0),
        '\u{2800}'..='\u{28ff}' => {
            let lit = u32::from(c) - 0x2800;
            Shape::Dots(DOTS.iter().enumerate().filter(|(bit, _)| lit >> bit & 1 == 1).map(|(_, dot)| *dot).collect())
        }
        _ => return None,
    })
}

/// The screen of so many columns and rows.
pub(super) fn of_screen(screen: &Screen, (columns, rows): (u16, u16)) -> String {
    let (width, height) = (WIDTH.mul_add(columns.into(), 2.0 * EDGE), HEIGHT.mul_add(rows.into(), 2.0 * EDGE));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"DejaVu Sans Mono,Menlo,Consolas,monospace\" font-size=\"13\">\n<rect width=\"{width}\" height=\"{height}\" rx=\"8\" fill=\"{PAPER}\"/>\n"
    );
    // One path for all dots of a colour.
    let mut dots: BTreeMap<(&str, bool), String> = BTreeMap::new();
    for row in 0..rows {
        let top = HEIGHT.mul_add(row.into(), EDGE);
        let mut run: Option<(f64, String, String)> = None;
        for column in 0..columns {
            let Some(cell) = screen.cell(row, column) else { continue };
            let left = WIDTH.mul_add(column.into(), EDGE);
            let (ink, paper) = if cell.inverse() { (PAPER, Some(colour(cell))) } else { (colour(cell), None) };
            if let Some(paper) = paper {
                writeln!(
                    svg,
                    "<rect x=\"{left}\" y=\"{top}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"{paper}\"/>"
                )
                .unwrap();
            }
            let text = if cell.contents().is_empty() { " " } else { cell.contents() };
            let drawn = text.chars().next().and_then(shape);
            match &drawn {
                Some(Shape::Block([x, y, wide, high], opacity)) => writeln!(
                    svg,
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{ink}\" opacity=\"{opacity}\"/>",
                    WIDTH.mul_add(*x, left),
                    HEIGHT.mul_add(*y, top),
                    WIDTH * wide,
                    HEIGHT * high
                )
                .unwrap(),
                Some(Shape::Dots(lit)) => {
                    let path = dots.entry((ink, cell.dim())).or_default();
                    for (x, y) in lit {
                        write!(path, "M{} {}h0", WIDTH.mul_add(*x, left), HEIGHT.mul_add(*y, top)).unwrap();
                    }
                }
                None => {}
            }
            let weight = if cell.bold() { " font-weight=\"bold\"" } else { "" };
            let opacity = if cell.dim() { " opacity=\"0.6\"" } else { "" };
            let style = format!("fill=\"{ink}\"{weight}{opacity}");
            let is_text = drawn.is_none() && text != " ";
            match &mut run {
                Some((_, of_run, said)) if *of_run == style && drawn.is_none() => said.push_str(text),
                _ => {
                    put(&mut svg, run.take(), top);
                    run = is_text.then(|| (left, style, text.to_owned()));
                }
            }
        }
        put(&mut svg, run, top);
    }
    for ((ink, is_dim), path) in dots {
        let opacity = if is_dim { " opacity=\"0.6\"" } else { "" };
        writeln!(svg, "<path d=\"{path}\" stroke=\"{ink}\"{opacity} stroke-width=\"2.6\" stroke-linecap=\"round\"/>")
            .unwrap();
    }
    svg + "</svg>\n"
}

/// Writes text that begins at a column, exactly as wide as its characters.
fn put(svg: &mut String, run: Option<(f64, String, String)>, top: f64) {
    let Some((left, style, said)) = run else { return };
    let said = said.trim_end();
    let width = WIDTH * said.chars().count() as f64;
    writeln!(
        svg,
        "<text x=\"{left}\" y=\"{}\" {style} textLength=\"{width}\" lengthAdjust=\"spacingAndGlyphs\" xml:space=\"preserve\">{}</text>",
        top + 13.0,
        escaped(said)
    )
    .unwrap();
}
