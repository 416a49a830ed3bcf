//! What holds for every protocol, whatever it speaks.

use super::*;
use crate::link::protocol::{Failure, ProtocolEvent};

/// All that waits.
fn waiting(protocol: &mut dyn Protocol) -> (Vec<Vec<u8>>, Vec<ProtocolEvent>) {
    (std::iter::from_fn(|| protocol.next_output()).collect(), std::iter::from_fn(|| protocol.next_event()).collect())
}

#[test]
fn a_shot_before_the_set_up_has_one_answer_and_sends_nothing() {
    for kind in WireProtocol::ALL {
        let mut protocol = quick(kind);
        protocol.trigger(Duration::from_secs(1));
        let (outputs, events) = waiting(protocol.as_mut());
        assert_eq!(outputs, Vec::<Vec<u8>>::new(), "{kind}");
        let is_refused = matches!(
            events.as_slice(),
            [ProtocolEvent::Failed(Failure::TooEarly(_) | Failure::Refused(_) | Failure::NotReady(_))]
        );
        assert!(is_refused, "{kind}: {events:?}");
    }
}

#[test]
fn a_new_start_forgets_what_waits_of_the_connection_before() {
    for kind in WireProtocol::ALL {
        let now = Duration::from_secs(1);
        let mut fresh = quick(kind);
        fresh.start(now);
        let mut used = quick(kind);
        used.trigger(now);
        used.start(now);
        used.trigger(now);
        used.feed(b"half a li", now);
        used.start(now);
        let (expected, found) = (waiting(fresh.as_mut()), waiting(used.as_mut()));
        assert_eq!(found.1, expected.1, "{kind}");
        // Numbers of requests may go on; nothing is sent twice.
        assert_eq!(found.0.len(), expected.0.len(), "{kind}");
    }
}
