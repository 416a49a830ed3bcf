//! Counting of occasions, and the written form.

use super::super::ascii::AsciiFault;
use super::super::geocom::GeocomFault;
use super::super::ndi::NdiFault;
use super::FaultPlan;
use super::NamedFault;
use super::Scheduled;

#[test]
fn a_fault_happens_from_its_occasion_on_and_ends() {
    let mut plan = FaultPlan::new([Scheduled { fault: AsciiFault::NotANumber, from: 3, times: 2 }]);
    let happened: Vec<bool> = (0..6).map(|_| plan.occasion(|_| true).is_some()).collect();
    assert_eq!(happened, [false, false, true, true, false, false]);
}

#[test]
fn other_occasions_do_not_count() {
    let mut plan = FaultPlan::new([Scheduled::once(AsciiFault::NotANumber, 2)]);
    assert_eq!(plan.occasion(|_| true), None);
    assert_eq!(plan.occasion(|fault| fault == AsciiFault::ErrorText), None);
    assert_eq!(plan.occasion(|_| true), Some(AsciiFault::NotANumber));
}

#[test]
fn the_written_form_says_what_is_wrong_with_it() {
    let read = |text: &str| text.parse::<Scheduled<AsciiFault>>();
    assert_eq!(read("not-a-number@3x2"), Ok(Scheduled { fault: AsciiFault::NotANumber, from: 3, times: 2 }));
    assert_eq!(read("not-a-number"), Ok(Scheduled::once(AsciiFault::NotANumber, 1)));
    assert!(read("not-a-number@0").is_err_and(|text| text.contains("count from 1")));
    assert!(read("nonsense").is_err_and(|text| text.contains("not-a-number")));
}

fn names_come_back<F: NamedFault>() {
    for &fault in F::ALL {
        let scheduled = Scheduled { fault, from: 2, times: 3 };
        assert_eq!(scheduled.to_string().parse(), Ok(scheduled));
    }
}

#[test]
fn every_name_comes_back() {
    names_come_back::<AsciiFault>();
    names_come_back::<GeocomFault>();
    names_come_back::<NdiFault>();
}
