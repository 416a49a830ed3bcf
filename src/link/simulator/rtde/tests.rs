//! Literal bytes of the simulated controller, so that it does not only agree with the link that it was written for.

use super::super::bench::MockCell;
use super::*;

/// What is answered to a request.
fn ask(simulator: &mut RtdeSimulator, request: &[u8]) -> Option<Output> {
    simulator.feed(request, &mut MockCell::default(), Moment::ZERO);
    simulator.next_output()
}

#[test]
fn the_published_requests_have_the_published_answers() {
    let mut simulator = RtdeSimulator::new(Vec::new());
    simulator.accept(Moment::ZERO);
    let bytes = |bytes: &[u8]| Some(Output::Bytes(bytes.to_vec()));
    assert_eq!(ask(&mut simulator, &[0x00, 0x05, 0x56, 0x00, 0x02]), bytes(&[0x00, 0x04, 0x56, 0x01]));
    let names = b"timestamp,actual_q";
    let head = [0x00, 0x1d, 0x4f, 0x40, 0x5f, 0x40, 0x00, 0x00, 0x00, 0x00, 0x00];
    let types = [&[0x00, 0x13, 0x4f, 0x01][..], b"DOUBLE,VECTOR6D"].concat();
    assert_eq!(ask(&mut simulator, &[&head[..], names].concat()), bytes(&types));
    assert_eq!(ask(&mut simulator, &[0x00, 0x03, 0x53]), bytes(&[0x00, 0x04, 0x53, 0x01]));
    assert_eq!(simulator.next_deadline(), Some(Duration::from_millis(8)));
    simulator.tick(&mut MockCell::default(), Duration::from_millis(8));
    let q: Vec<u8> = [0.1, -1.2, 1.3, -0.4, 0.5, -0.6].iter().flat_map(|value| f64::to_be_bytes(*value)).collect();
    let data = [&[0x00, 0x3c, 0x55, 0x01][..], &0.008_f64.to_be_bytes(), &q].concat();
    assert_eq!(simulator.next_output(), bytes(&data));
    assert_eq!(ask(&mut simulator, &[0x00, 0x03, 0x50]), bytes(&[0x00, 0x04, 0x50, 0x01]));
    assert_eq!(simulator.next_deadline(), None);
}

#[test]
fn unknown_names_are_not_found_and_nothing_starts() {
    let mut simulator = RtdeSimulator::new(Vec::new());
    simulator.accept(Moment::ZERO);
    let request = [&[0, 37, b'O'][..], &125_f64.to_be_bytes(), b"actual_q,actual_TCP_pose__"].concat();
    let answer = [&[0, 22, b'O', 0][..], b"VECTOR6D,NOT_FOUND"].concat();
    assert_eq!(ask(&mut simulator, &request), Some(Output::Bytes(answer)));
    assert_eq!(ask(&mut simulator, &[0, 3, b'S']), Some(Output::Bytes(vec![0, 4, b'S', 0])));
    assert_eq!(ask(&mut simulator, &[0, 0]), Some(Output::Close));
}

/// The recipe that the receiving client of a public library asks for by default.
const FULL_RECIPE: &str = "timestamp,target_q,target_qd,target_qdd,target_current,target_moment,actual_q,actual_qd,\
    actual_current,joint_control_output,actual_TCP_pose,actual_TCP_speed,actual_TCP_force,target_TCP_pose,\
    target_TCP_speed,actual_digital_input_bits,joint_temperatures,actual_execution_time,robot_mode,joint_mode,safety_mode,\
    safety_status,actual_tool_accelerometer,speed_scaling,target_speed_fraction,actual_momentum,actual_main_voltage,\
    actual_robot_voltage,actual_robot_current,actual_joint_voltage,actual_digital_output_bits,runtime_state,\
    robot_status_bits,safety_status_bits,standard_analog_input0,standard_analog_input1,standard_analog_output0,\
    standard_analog_output1,payload,payload_cog,payload_inertia,ft_raw_wrench,output_bit_registers0_to_31,\
    output_bit_registers32_to_63,output_bit_register_64,output_int_register_0,output_double_register_47";

#[test]
fn the_full_recipe_of_other_clients_is_known_and_has_the_announced_size() {
    let mut simulator = RtdeSimulator::new(Vec::new());
    simulator.accept(Moment::ZERO);
    let content = [&125_f64.to_be_bytes()[..], FULL_RECIPE.as_bytes()].concat();
    let request = encode(packet_type::CONTROL_PACKAGE_SETUP_OUTPUTS, &content);
    let Some(Output::Bytes(answer)) = ask(&mut simulator, &request) else { panic!() };
    let types = String::from_utf8(answer[4..].to_vec()).unwrap();
    let size = |kind: &str| match kind {
        "BOOL" => 1,
        "INT32" | "UINT32" => 4,
        "UINT64" | "DOUBLE" => 8,
        "VECTOR3D" | "VECTOR6INT32" => 24,
        "VECTOR6D" => 48,
        other => panic!("{other}"),
    };
    let expected: usize = types.split(',').map(size).sum();
    assert_eq!(types.split(',').count(), FULL_RECIPE.split(',').count());
    ask(&mut simulator, &[0x00, 0x03, 0x53]);
    simulator.tick(&mut MockCell::default(), Duration::from_millis(8));
    let Some(Output::Bytes(data)) = simulator.next_output() else { panic!() };
    assert_eq!(data.len(), 4 + expected);
}
