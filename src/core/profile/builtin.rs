//! The shipped profiles, inside the program.

/// Name and text of every shipped profile, sorted by name.
const BUILTIN: &[(&str, &str)] = &[
    ("abb_irb120", include_str!("../../../profiles/abb_irb120.ron")),
    ("abb_irb1600_6_145", include_str!("../../../profiles/abb_irb1600_6_145.ron")),
    ("epson_ls3_b401s", include_str!("../../../profiles/epson_ls3_b401s.ron")),
    ("fanuc_lrmate200id", include_str!("../../../profiles/fanuc_lrmate200id.ron")),
    ("franka_panda", include_str!("../../../profiles/franka_panda.ron")),
    ("kuka_iiwa14", include_str!("../../../profiles/kuka_iiwa14.ron")),
    ("kuka_iiwa7", include_str!("../../../profiles/kuka_iiwa7.ron")),
    ("kuka_kr6_r900", include_str!("../../../profiles/kuka_kr6_r900.ron")),
    ("meca500", include_str!("../../../profiles/meca500.ron")),
    ("soochow", include_str!("../../../profiles/soochow.ron")),
    ("staubli_tx2_60", include_str!("../../../profiles/staubli_tx2_60.ron")),
    ("ur10", include_str!("../../../profiles/ur10.ron")),
    ("ur10e", include_str!("../../../profiles/ur10e.ron")),
    ("ur5", include_str!("../../../profiles/ur5.ron")),
    ("ur5e", include_str!("../../../profiles/ur5e.ron")),
];

/// Names of the shipped profiles, sorted.
pub fn builtin_names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

/// Text of a shipped profile.
pub fn builtin(name: &str) -> Option<&'static str> {
    BUILTIN.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
