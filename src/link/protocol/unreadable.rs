//! Messages that cannot be read: one is noise, several in a row are a wrong setting.

/// So many in a row are a wrong setting.
const IN_A_ROW: u32 = 3;

/// Messages since the last one that could be read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unreadable {
    in_a_row: u32,
}

impl Unreadable {
    /// One could be read, or a connection is new.
    pub fn clear(&mut self) {
        self.in_a_row = 0;
    }

    /// One more of the `messages`, such as `lines`, cannot be read, for this reason: what to say and to check once it is no noise.
    pub fn one_more(&mut self, messages: &str, why: &str, check: &str) -> Option<String> {
        self.in_a_row = self.in_a_row.saturating_add(1);
        let text = || format!("{IN_A_ROW} {messages} in a row cannot be read ({why}): check {check}");
        (self.in_a_row == IN_A_ROW).then(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_third_in_a_row_is_said_and_no_other() {
        let mut unreadable = Unreadable::default();
        let mut said = |count: u32| -> Vec<String> {
            unreadable.clear();
            (0..count).filter_map(|_| unreadable.one_more("lines", "no number", "the baud rate")).collect()
        };
        assert_eq!(said(2), Vec::<String>::new());
        assert_eq!(said(1000), ["3 lines in a row cannot be read (no number): check the baud rate"]);
        assert_eq!(said(3).len(), 1);
    }
}
