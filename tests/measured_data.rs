//! Real robots.
use trupose::identification::verification::*;
use trupose::identification::*;
use trupose::profile::*;
use trupose::session::measurements::*;
use trupose::units::to_mm;

fn load(file: &str, p: &Profile) -> Vec<PointSample> {
    let text = std::fs::read_to_string(format!("../shared/data/{file}")).unwrap();
    let joints: Vec<_> = p.chain().joints().iter().map(|j| j.joint_type).collect();
    let m = read(&text, file, &joints).unwrap();
    m.rows
        .iter()
        .map(|r| PointSample {
            at: TargetAt { configuration: r.configuration.clone(), target: 0 },
            station: 0,
            point: r.point,
            sigma: None,
        })
        .collect()
}
fn go(name: &str, ident: Vec<PointSample>, verify: &[PointSample], refit: bool) {
    let (p, _) = Profile::parse(builtin(name).unwrap(), name).unwrap();
    for est in [Estimator::Robust, Estimator::LeastSquares] {
        let params = p.free_parameters(Level::Geometric);
        let targets: Vec<_> = p.targets().iter().map(|t| t.position_in_flange).collect();
        let obs = Observations { points: ident.clone(), ..Default::default() };
        let problem = Problem { chain: p.chain(), targets: &targets, parameters: &params, observations: &obs };
        let t = std::time::Instant::now();
        let f = identify(&problem, &Settings { estimator: est, ..Default::default() }, &mut |_| {}).unwrap();
        println!(
            "{name} {est:?} {:?} n {} rank {:?} k {:?} sigma {:.4} rej {} it {} {:?}",
            t.elapsed(),
            params.len(),
            f.observability.rank,
            f.observability.condition_number,
            to_mm(f.sigma.used),
            f.rejected.len(),
            f.iterations.len(),
            f.termination
        );
        let free: Vec<_> = params
            .iter()
            .copied()
            .filter(|p| matches!(p.id, trupose::kinematics::ParameterId::Target { .. }))
            .collect();
        let nom = fit_setup(
            &ArmModel { chain: p.chain().clone(), targets: targets.clone() },
            &free,
            if refit { verify } else { &ident },
            |_| true,
        )
        .unwrap();
        let idf = if refit {
            fit_setup(&f.model, &free, verify, |_| true).unwrap()
        } else {
            FittedSetup { model: f.model.clone(), base_from_station: f.base_from_station.clone() }
        };
        for s in [nom, idf] {
            let e = ModelErrors::new(&s.model, &s.base_from_station, verify).unwrap();
            println!(
                "   rms {:.4} mean {:.4} max {:.4} dist {:?}",
                to_mm(e.position.rms),
                to_mm(e.position.mean),
                to_mm(e.position.max),
                e.distance.map(|d| to_mm(d.mean))
            );
        }
        if ident.len() < 100 {
            for e in &f.estimates {
                println!(
                    "   {} {:.4} ± {:.4} {} {}",
                    e.id,
                    e.id.quantity().to_edge(e.deviation),
                    e.id.quantity().to_edge(e.sigma),
                    e.id.quantity().unit(),
                    e.identifiable
                );
            }
            for g in &f.observability.groups {
                println!("   {}", g.description);
            }
        }
    }
}
#[test]
fn quick() {
    let (p5, _) = Profile::parse(builtin("ur5").unwrap(), "").unwrap();
    let grid = load("ur5/grid.csv", &p5);
    let random = load("ur5/random.csv", &p5);
    let a: Vec<_> = grid.iter().step_by(17).cloned().collect();
    let b: Vec<_> = grid.iter().enumerate().filter(|(i, _)| i % 17 != 0).map(|(_, s)| s.clone()).collect();
    println!("{} {}", a.len(), b.len());
    go("ur5", a.clone(), &b, false);
    go("ur5", a, &random, false);
    go("ur5", grid, &random, false);
    let sb = load("ur10/series_b.csv", &p5);
    let sc = load("ur10/series_c.csv", &p5);
    let a: Vec<_> = sb.iter().enumerate().filter(|(i, _)| i % 10 < 7).map(|(_, s)| s.clone()).collect();
    let b: Vec<_> = sb.iter().enumerate().filter(|(i, _)| i % 10 >= 7).map(|(_, s)| s.clone()).collect();
    go("ur10", a.clone(), &b, false);
    go("ur10", a, &sc, true);
}
