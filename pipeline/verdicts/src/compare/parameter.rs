//! A parameter: the number that an experiment's file holds at a path.

use crate::verdict::one_of;
use toml::de::DeValue;

/// The number that an experiment's file holds at `path`: keys joined by dots, `[i]` from 0, a list of tables
/// entered by `id` or `name`. A key that has dots itself, as those of a case, stands in single quotes:
/// `case.far.'prior.center'[0]`. Fails with what there is where the path ends.
pub fn parameter(text: &str, path: &str) -> Result<f64, String> {
    let table = toml::de::DeTable::parse(text).map_err(|e| format!("TOML: {e}"))?;
    let mut at = DeValue::Table(table.into_inner());
    for part in parts(path) {
        at = entered(at, part)?;
    }
    let number = match (at.as_float(), at.as_integer()) {
        (Some(x), _) => Some(x.as_str().to_owned()),
        (_, Some(i)) => Some(i.as_str().to_owned()),
        _ => None,
    };
    number
        .and_then(|text| text.replace('_', "").parse().ok())
        .ok_or_else(|| format!("a path to a number, not to what {path} is"))
}

/// The keys and indices of a path, the quoted ones without their quotes.
fn parts(path: &str) -> Vec<&str> {
    let (mut parts, mut rest) = (Vec::new(), path);
    loop {
        let (part, after) = match rest.strip_prefix('\'').and_then(|r| r.split_once('\'')) {
            Some(quoted) => quoted,
            None => {
                let inside = usize::from(rest.starts_with('['));
                let end = rest[inside..].find(['.', '[']);
                rest.split_at(end.map_or(rest.len(), |end| end + inside))
            }
        };
        parts.push(part);
        if after.is_empty() {
            return parts;
        }
        rest = after.strip_prefix('.').unwrap_or(after);
    }
}

fn entered<'a>(at: DeValue<'a>, part: &str) -> Result<DeValue<'a>, String> {
    let index = part.strip_prefix('[').and_then(|p| p.strip_suffix(']'));
    match (index, at) {
        (Some(index), DeValue::Array(items)) => {
            let n = items.len();
            let item = (index.parse().ok()).and_then(|i: usize| items.into_iter().nth(i));
            item.map(|item| item.into_inner())
                .ok_or_else(|| format!("an index from 0 to {} in place of {index:?}", n.max(1) - 1))
        }
        (None, DeValue::Table(mut table)) => match table.remove(part) {
            Some(value) => Ok(value.into_inner()),
            None => {
                let keys: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
                Err(one_of(part, &keys))
            }
        },
        (None, DeValue::Array(items)) => {
            let name = |item: &toml::Spanned<DeValue<'a>>| {
                let key = |k| item.get_ref().get(k).and_then(|v| v.as_ref().as_str());
                key("id").or(key("name")).unwrap_or_default().to_owned()
            };
            let names: Vec<String> = items.iter().map(name).collect();
            let found = items.into_iter().find(|item| name(item) == part);
            found
                .map(|item| item.into_inner())
                .ok_or_else(|| one_of(part, &names.iter().map(String::as_str).collect::<Vec<_>>()))
        }
        _ => Err(format!("a path that ends before {part:?}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "steps = 40\n[noise]\nw = { covariance = [[1.0, 2.5], [3.0, 4.0]] }\n\
                        [[estimator]]\nid = \"f\"\nphi = 100\n[[metric]]\nname = \"rmse\"\nfrom = 4\n\
                        [[case]]\nid = \"far\"\n\"prior.center\" = [5.0, -5]\n\"estimator.f.phi\" = 20\n";

    #[test]
    fn a_parameter_is_found_by_its_path() {
        for (path, value) in [
            ("steps", 40.0),
            ("noise.w.covariance[0][1]", 2.5),
            ("estimator.f.phi", 100.0),
            ("metric.rmse.from", 4.0),
            ("case.far.'prior.center'[1]", -5.0),
            ("case.far.'estimator.f.phi'", 20.0),
        ] {
            assert_eq!(parameter(TEXT, path), Ok(value), "{path}");
        }
    }

    #[test]
    fn a_wrong_path_is_answered_with_what_there_is() {
        for (path, told) in [
            ("stepss", "did you mean steps?"),
            ("metric.rmse.form", "did you mean from?"),
            ("estimator.g.phi", "one of f"),
            ("noise.w.covariance[0][2]", "from 0 to 1"),
            ("noise.w", "a path to a number"),
            ("steps.x", "ends before"),
            ("steps..x", "ends before"),
            ("", "one of"),
            ("case.far.'prior.centre'[0]", "did you mean prior.center?"),
            ("case.far.prior.center[0]", "one of"),
            ("case.far.'prior.center", "one of"),
        ] {
            let expected = parameter(TEXT, path).unwrap_err();
            assert!(expected.contains(told), "{path}: {expected}");
        }
    }
}
