//! `Wrist::direct`: cranks, two equations, the platform's columns; and the Jacobian made of them.

use crate::trace::{Trace, Value};
use crate::vector::ROOT_TWO_LESS_ONE_Q32;

/// What `Push` holds of a leg.
#[derive(Clone, Copy)]
pub struct Push {
    pub back: [Value; 3],
    pub offset: Value,
    pub shift: [Value; 2],
    pub center: [Value; 2],
}

/// Takes a leg's constants from outside.
pub fn push(trace: &mut Trace) -> Push {
    Push {
        back: trace.inputs(["a_x", "a_y", "a_z"], 29),
        offset: trace.input("offset", 29),
        shift: trace.inputs(["right", "up"], 31),
        center: trace.inputs(["center_y", "center_z"], 29),
    }
}

/// A leg with its crank turned.
#[derive(Clone, Copy)]
pub struct Crank {
    pub sine: Value,
    pub cosine: Value,
    pub back: [Value; 3],
    pub offset: Value,
}

/// `Push::turned`.
pub fn turned(trace: &mut Trace, push: &Push, [sine, cosine]: [Value; 2]) -> Crank {
    let half_sine = trace.right("half_sine", sine, 1);
    let half_cosine = trace.right("half_cosine", cosine, 1);
    let [x, y, z] = push.back;
    let offset = trace.subtract("turned_offset", push.offset, half_sine);
    let offset = trace.high_add("shifted_right", offset, cosine, push.shift[0]);
    let offset = trace.high_add("shifted_up", offset, sine, push.shift[1]);
    Crank {
        sine,
        cosine,
        back: [
            x,
            trace.subtract("b_y", y, half_cosine),
            trace.subtract("b_z", z, half_sine),
        ],
        offset,
    }
}

/// `times_root_two`, read with one bit more.
fn over_root_two(trace: &mut Trace, name: &str, number: Value) -> Value {
    let factor = trace.constant(&format!("{name}_factor"), ROOT_TWO_LESS_ONE_Q32.into(), 32);
    let product = trace.high_add(&format!("{name}_q30"), number, number, factor);
    trace.read_as(name, product, 31)
}

/// Sine and cosine of θ3, from those of θ3 − π/4.
pub fn third(trace: &mut Trace, [sine, cosine]: [Value; 2]) -> [Value; 2] {
    let difference = trace.subtract("difference", cosine, sine);
    let sum = trace.add("sum", cosine, sine);
    [
        over_root_two(trace, "c3", difference),
        over_root_two(trace, "s3", sum),
    ]
}

/// Half the tangent of a root of K cos α + M sin α = N.
#[derive(Clone, Copy)]
pub struct Root {
    pub square: Value,
    pub half_margin: Value,
    pub margin: Value,
    pub below: Value,
    pub above: Value,
    pub tangent: Value,
}

/// `Root::find` up to its tangent.
pub fn find(trace: &mut Trace, side: i32, [k, m, n]: [Value; 3]) -> Root {
    let minus_n = trace.negate("minus_n", n);
    let square = trace.products("square", &[(k, k), (m, m), (n, minus_n)]);
    let shifted = trace.right("square_q29", square, 29);
    let root_of = trace.read_as("root_of", shifted, 31);
    let half_margin = trace.root("half_margin", root_of);
    let margin = trace.read_as("margin", half_margin, 29);
    let below = trace.subtract("below", n, k);
    let above = if side < 0 {
        trace.subtract("above", margin, m)
    } else {
        trace.subtract("above", m, margin)
    };
    let doubled = trace.left("above_q30", above, 1);
    let tangent = trace.ratio("tangent", doubled, below);
    Root {
        square,
        half_margin,
        margin,
        below,
        above,
        tangent,
    }
}

/// `Root::find` from its tangent on: the sine and the cosine.
pub fn sine_cosine(trace: &mut Trace, tangent: Value) -> [Value; 2] {
    let (number, divisor) = cosine_parts(trace, tangent);
    let cosine = trace.ratio("cosine", number, divisor);
    let one = trace.constant("one", 1 << 30, 30);
    let fall = trace.subtract("fall", cosine, one);
    let fall = trace.left("", fall, 1);
    let twice = trace.read_as("twice_tangent", tangent, 30);
    let part = trace.high("sine_part", tangent, fall);
    [trace.add("sine", twice, part), cosine]
}

/// 1 − t² and 1 + t², the first one step short.
fn cosine_parts(trace: &mut Trace, tangent: Value) -> (Value, Value) {
    let square = trace.high("tangent_square", tangent, tangent);
    let square = trace.right("tangent_square_q29", square, 1);
    let below_one = trace.constant("below_one", (1 << 29) - 1, 29);
    let one = trace.constant("one_q29", 1 << 29, 29);
    (
        trace.subtract("cosine_number", below_one, square),
        trace.add("cosine_divisor", one, square),
    )
}

/// `Push::serial`.
pub fn serial(trace: &mut Trace, push: &Push, crank: &Crank, point: [Value; 3]) -> Value {
    let half_y = trace.right("half_y", point[1], 1);
    let half_z = trace.right("half_z", point[2], 1);
    let minus_e = trace.subtract("minus_e", push.center[0], half_y);
    let f = trace.subtract("f", half_z, push.center[1]);
    trace.dot("serial", &[(f, crank.cosine), (minus_e, crank.sine)], 29)
}

/// Leg 1's equation: −K, M, and −P.
pub fn first_equation(trace: &mut Trace, c3: Value, s3: Value, crank: &Crank) -> [Value; 3] {
    let minus_s3 = trace.negate("minus_s3", s3);
    let [bx, by, bz] = crank.back;
    let behind = trace.dot("behind", &[(c3, bx), (s3, by)], 31);
    let across = trace.dot("across", &[(c3, by), (minus_s3, bx)], 30);
    [behind, bz, across]
}

/// The axes x'' and z'' from φ.
pub fn first_axes(trace: &mut Trace, c3: Value, s3: Value, phi: [Value; 2]) -> [[Value; 3]; 2] {
    let [sine_q30, cosine_q30] = phi;
    let cosine = trace.left("", cosine_q30, 1);
    let sine = trace.left("", sine_q30, 1);
    let x = [
        trace.high("x_x", c3, cosine),
        trace.high("x_y", s3, cosine),
        trace.negate("x_z", sine_q30),
    ];
    let z_x = trace.high("z_x", c3, sine);
    let z_y = trace.high("z_y", s3, sine);
    let z = [trace.left("", z_x, 1), trace.left("", z_y, 1), cosine];
    [x, z]
}

/// Leg 2's equation: −K, M, and B·x''.
pub fn second_equation(
    trace: &mut Trace,
    [c3, s3]: [Value; 2],
    crank: &Crank,
    [x, z]: [[Value; 3]; 2],
) -> [Value; 3] {
    let minus_s3 = trace.negate("minus_s3", s3);
    let [bx, by, bz] = crank.back;
    let behind = trace.dot("behind", &[(c3, by), (minus_s3, bx)], 31);
    let across = trace.dot("across", &[(bx, z[0]), (by, z[1]), (bz, z[2])], 31);
    let along = trace.dot("along", &[(bx, x[0]), (by, x[1]), (bz, x[2])], 29);
    [behind, across, along]
}

/// C2 and the platform's axis from ψ.
pub fn second_axes(
    trace: &mut Trace,
    [c3, s3]: [Value; 2],
    z: [Value; 3],
    psi: [Value; 2],
) -> [[Value; 3]; 2] {
    let minus_s3 = trace.negate("minus_s3", s3);
    let minus_c3 = trace.negate("minus_c3", c3);
    let [sine, cosine] = psi.map(|value| trace.left("", value, 1));
    [
        [
            trace.dot("point_x", &[(z[0], sine), (minus_s3, cosine)], 32),
            trace.dot("point_y", &[(z[1], sine), (c3, cosine)], 32),
            trace.high("point_z", z[2], sine),
        ],
        [
            trace.dot("axis_x", &[(z[0], cosine), (s3, sine)], 32),
            trace.dot("axis_y", &[(z[1], cosine), (minus_c3, sine)], 32),
            trace.high("axis_z", z[2], cosine),
        ],
    ]
}

/// B·x'' times sine and cosine of ψ.
pub fn along_parts(trace: &mut Trace, along: Value, turn: [Value; 2]) -> [Value; 2] {
    let [sine, cosine] = turn.map(|value| trace.left("", value, 1));
    [
        trace.high("along_sine", along, sine),
        trace.high("along_cosine", along, cosine),
    ]
}

/// `invert`: 1 / W in Q30.
fn invert(trace: &mut Trace, name: &str, margin: Value) -> Value {
    let one = trace.constant(&format!("{name}_one"), 1 << 28, 28);
    let ratio = trace.ratio(name, one, margin);
    trace.left("", ratio, 1)
}

/// `First::new`: gear and lean.
pub fn first(trace: &mut Trace, margin: Value, serial: Value, across: Value) -> [Value; 2] {
    let inverse = invert(trace, "inverse1", margin);
    let lean = trace.high("lean1", across, inverse);
    [
        trace.high("gear1", serial, inverse),
        trace.left("", lean, 2),
    ]
}

/// `Second::new`: gear, skew and lean.
pub fn second(trace: &mut Trace, margin: Value, serial: Value, along: [Value; 2]) -> [Value; 3] {
    let inverse = invert(trace, "inverse2", margin);
    let skew = trace.high("skew", along[0], inverse);
    let lean = trace.high("lean2", along[1], inverse);
    [
        trace.high("gear2", serial, inverse),
        trace.left("", skew, 3),
        trace.left("", lean, 1),
    ]
}

/// det A from W of both legs and ρ1 ρ2.
pub fn determinant(trace: &mut Trace, margin1: Value, margin2: Value, cranks: Value) -> Value {
    let both = trace.high("both", margin1, margin2);
    let both = trace.left("", both, 3);
    let product = trace.high("determinant", both, cranks);
    trace.left("", product, 2)
}

/// `Jacobian::new`: the rows of the map of torques, from x'', y' = (−s3, c3, 0) and z''.
pub fn rows(
    trace: &mut Trace,
    [x, z]: [[Value; 3]; 2],
    [c3, s3]: [Value; 2],
    first: [Value; 2],
    second: [Value; 3],
) -> [[Value; 3]; 3] {
    let minus_s3 = trace.negate("minus_s3", s3);
    let minus_c3 = trace.negate("minus_c3", c3);
    let [gear1, lean1] = first;
    let [gear2, skew, lean2] = second;
    let ex = trace.high("ex", gear1, skew);
    let ex = trace.left("", ex, 2);
    let ey = trace.right("ey", gear1, 1);
    let product = trace.high("lean_skew", lean1, skew);
    let sum = trace.subtract("lean_sum", lean2, product);
    let gx = trace.high("gx", z[2], sum);
    let gx = trace.left("", gx, 1);
    let gy = trace.high("gy_q29", z[2], lean1);
    let gy = trace.right("gy", gy, 2);
    let gz = trace.right("gz", z[2], 4);
    [
        [
            trace.dot("row1_x", &[(ex, x[0]), (ey, s3)], 32),
            trace.dot("row1_y", &[(ex, x[1]), (ey, minus_c3)], 32),
            trace.high("row1_z", ex, x[2]),
        ],
        [
            trace.high("row2_x", gear2, x[0]),
            trace.high("row2_y", gear2, x[1]),
            trace.high("row2_z", gear2, x[2]),
        ],
        [
            trace.dot("row3_x", &[(gx, x[0]), (gy, minus_s3), (gz, z[0])], 32),
            trace.dot("row3_y", &[(gx, x[1]), (gy, c3), (gz, z[1])], 32),
            trace.dot("row3_z", &[(gx, x[2]), (gz, z[2])], 32),
        ],
    ]
}
