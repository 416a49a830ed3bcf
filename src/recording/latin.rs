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
            'µ' | 'μ' => plain.push('u'),
            '°' => plain.push_str(" deg"),
            '±' => plain.push_str("+-"),
            '…' => plain.push_str("..."),
            '²' => plain.push_str("^2"),
            '\u{2019}' => plain.push('\''),
            // Every viewer draws Latin letters with diacritics.
            '\n' | ' '..='~' | 'À'..='ÿ' => plain.push(c),
            _ => plain.push('?'),
        }
    }
    plain
}
