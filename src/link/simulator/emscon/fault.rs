//! What a simulated tracker can do wrong.

use super::super::fault::faults;

faults! {
    /// A fault of the simulated tracker. The occasion is a measurement that was asked for unless its text says otherwise.
    pub EmsconFault {
        Drip "drip" "Sends every byte in a write of its own. Occasion: a connection.",
        Joined "joined" "Measures in no time and sends all answers in one write. Occasion: a connection.",
        InUse "in-use" "Says that another program is connected, and hangs up. Occasion: a connection.",
        Scaled "scaled" "Has a transformation with scale 1.0001 that is applied. Occasion: a connection.",
        Moved "moved" "Has a transformation that shifts by 0.5 m and does not scale, and is applied. Occasion: a connection.",
        UnusedScale "unused-scale" "Has a transformation with scale 1.0001 that is not applied. Occasion: a connection.",
        WarmingUp "warming-up" "Its laser is warming up. Occasion: a reading of the system status.",
        Metres "metres" "Accepts new units and stays with metres. Occasion: a setting of the units.",
        TryStuck "try-stuck" "Accepts new system settings and stays in try mode. Occasion: a setting of them.",
        NoStationary "no-stationary" "Does not know the duration of a measurement. Occasion: a setting of it.",
        Busy "busy" "Answers that the server is busy.",
        NotReady "not-ready" "Answers with the error that the measurement status is not ready.",
        Mute "mute" "Stops answering at all until somebody connects again.",
        Early "early" "Sends a result of its own remote control before it accepts the command.",
        Flood "flood" "Sends 2000 positions of the reflector between the acceptance and the result.",
        UnitsChanged "units-changed" "Another program sets metres and degrees before the result.",
        TypeChanged "type-changed" "Another program sets spherical coordinates before the result.",
        FrameChanged "frame-changed" "Another program shifts the frame before the result.",
        ReflectorChanged "reflector-changed" "Another program chooses another reflector before the result.",
        SilentMetres "silent-metres" "Sends one result in metres without a word.",
        LateError "late-error" "Accepts the command, then sends an error instead of the result.",
        UnlistedError "unlisted-error" "Accepts the command, then sends an error with an unlisted number.",
        LostBeam "lost-beam" "Accepts the command, then says 'not ready' and sends no result.",
        Silence "silence" "Accepts the command, then sends nothing.",
        TryMode "try-mode" "Marks the result as a rehearsal.",
        WrongMode "wrong-mode" "Marks the result as the centre of a sphere.",
        BadStatus "bad-status" "Sends a result whose status is no success.",
        ZeroPoint "zero-point" "Sends a result at the origin.",
        NotFinite "not-finite" "Sends a result with a coordinate that is no number.",
        ExtendedResult "extended-result" "Sends the result with extended statistics.",
        LongResult "long-result" "Sends a result that is 16 bytes longer than known.",
        ShortResult "short-result" "Sends a result that is 56 bytes shorter than known.",
        UnknownType "unknown-type" "Sends a packet of type 42 before the result.",
        CutAfter20 "cut-20" "Hangs up after 20 bytes of the result.",
        SizeZero "size-zero" "Sends a result whose size field is 0.",
        SizeNegative "size-negative" "Sends a result whose size field is -1.",
        SizeHuge "size-huge" "Sends a result whose size field is 2 GB.",
        Closing "closing" "Says that the server closes, and hangs up, instead of the result.",
    }
}
