//! exp, log, ad, Ad and the inverse on SE(2) against values from numpy and scipy's `expm`
//! (`tests/reference/se2.json`), to 1e-12: the series of `expm` is good to 8e-14 at these sizes.

use serde::Deserialize;
use zonobench_sets::se2::{Matrix3, Se2, ad};

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Case {
    zeta: [f64; 3],
    exp: Matrix3<f64>,
    log: [f64; 3],
    ad: Matrix3<f64>,
    Ad: Matrix3<f64>,
    inv: Matrix3<f64>,
}

fn assert_close(what: &str, zeta: [f64; 3], got: &[f64], expected: &[f64]) {
    for (g, e) in got.iter().zip(expected) {
        assert!(
            (g - e).abs() < 1e-12,
            "{what} of {zeta:?}: {got:?}, expected {expected:?}"
        );
    }
}

#[test]
fn the_maps_of_se2_agree_with_the_reference() {
    let text = include_str!("reference/se2.json");
    let file: File = serde_json::from_str(text).unwrap();
    assert_eq!(file.cases.len(), 11);
    for case in file.cases {
        let x = Se2::exp(case.zeta);
        assert_close(
            "exp",
            case.zeta,
            x.matrix().as_flattened(),
            case.exp.as_flattened(),
        );
        assert_close("log", case.zeta, &x.log(), &case.log);
        assert_close(
            "ad",
            case.zeta,
            ad(case.zeta).as_flattened(),
            case.ad.as_flattened(),
        );
        assert_close(
            "Ad",
            case.zeta,
            x.adjoint().as_flattened(),
            case.Ad.as_flattened(),
        );
        assert_close(
            "inv",
            case.zeta,
            x.inverse().matrix().as_flattened(),
            case.inv.as_flattened(),
        );
    }
}
