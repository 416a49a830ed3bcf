//! Texts in the letters that every viewer can draw.

/// Returns a text in plain Latin letters; some viewers cannot draw others.
pub(super) fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\u{2212}' | '\u{2013}' | '\u{2014}' => plain.push('-'),
            '\u{394}' => plain.push('d'),
            'σ' => plain.push_str("sigma"),
            'α' => plain.push_str("alpha"),
            'β' => plain.push_str("beta"),
            'θ' => plain.push_str("theta"),
            'μ' => plain.push('µ'),
            '…' => plain.push_str("..."),
            '\u{2019}' => plain.push('\''),
            // Every viewer draws the letters and signs of Latin-1, and the arrow.
            '\n' | ' '..='~' | '\u{a1}'..='ÿ' | '→' => plain.push(c),
            _ => plain.push('?'),
        }
    }
    plain
}
