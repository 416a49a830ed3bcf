use trupose::identification::verification::*;
use trupose::identification::*;
use trupose::profile::*;
use trupose::session::measurements::*;
use trupose::units::to_mm;
fn load(file: &str, p: &Profile) -> Vec<PointSample> {
    let text = std::fs::read_to_string(format!("../shared/data/{file}")).unwrap();
    let joints: Vec<_> = p.chain().joints().iter().map(|j| j.joint_type).collect();
    let m = read(&text, file, &joints).unwrap();
    m.rows.iter().map(|r| PointSample { at: TargetAt { configuration: r.configuration.clone(), target: 0 }, station: 0, point: r.point, sigma: None }).collect()
}
#[test]
fn quick() {
    let (p, _) = Profile::parse(builtin("ur5").unwrap(), "").unwrap();
    let grid = load("ur5/grid.csv", &p);
    let random = load("ur5/random.csv", &p);
    let a: Vec<_> = grid.iter().step_by(17).cloned().collect();
    let b: Vec<_> = grid.iter().enumerate().filter(|(i, _)| i % 17 != 0).map(|(_, s)| s.clone()).collect();
    for (w, z) in [(Weighting::Covariance, 31e-3), (Weighting::Uniform, 31e-3), (Weighting::Covariance, 28.2e-3)] {
    for s in [0.01, 0.02, 0.03, 0.05, 0.0625, 0.08, 0.1, 0.15, 0.2] {
        let mut params = p.free_parameters(Level::Geometric);
        for q in &mut params { if let trupose::kinematics::ParameterId::Target{..} = q.id { q.expected = 0.05; } }
        let targets = vec![nalgebra::Point3::new(0.0, 0.0, z)];
        let obs = Observations { points: a.clone(), ..Default::default() };
        let problem = Problem { chain: p.chain(), targets: &targets, parameters: &params, observations: &obs };
        let f = identify(&problem, &Settings { weighting: w, sigma: Some((s*1e-3, SigmaSource::Option)), ..Default::default() }, &mut |_| {}).unwrap();
        let e = ModelErrors::new(&f.model, &f.base_from_station, &b).unwrap();
        let g = ModelErrors::new(&f.model, &f.base_from_station, &random).unwrap();
        println!("{w:?} z {z} s {s} grid mean {:.4} max {:.4} random mean {:.4} rms {:.4} max {:.4}  resid {:?}", to_mm(e.position.mean), to_mm(e.position.max), to_mm(g.position.mean),to_mm(g.position.rms), to_mm(g.position.max), f.sigma.from_residuals.map(to_mm));
    }}
}
