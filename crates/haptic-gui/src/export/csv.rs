//! Every sample that is seen, as CSV.

use crate::model::Model;
use haptic_ipc::SAMPLE_COLUMNS;

/// Every sample that is seen, every column, as CSV.
#[must_use]
pub fn csv(model: &Model) -> String {
    let scope = model.scope();
    let seen = scope.seen();
    let mut text = SAMPLE_COLUMNS.join(",");
    text.push('\n');
    for sample in scope.tape().within(seen.from_s, seen.to_s) {
        let object = sample.to_object();
        let cells = object.values().map(|value| match value {
            serde_json::Value::String(word) => word.clone(),
            number => number.to_string(),
        });
        text.push_str(&cells.collect::<Vec<_>>().join(","));
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::tests::with_samples;

    #[test]
    fn the_table_holds_every_sample_that_is_seen() {
        let mut model = with_samples();
        model.scope_mut().zoom(5.0, 0.0);
        let text = csv(&model);
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some(SAMPLE_COLUMNS.join(",").as_str()));
        let times: Vec<f64> = lines
            .map(|line| {
                line.split(',')
                    .nth(1)
                    .and_then(|cell| cell.parse().ok())
                    .expect("a time")
            })
            .collect();
        assert_eq!(times.last(), Some(&1.999));
        assert!(times.len() >= 999 && times[0] > 0.99, "a second of two is seen");
        assert!(text.contains(",42.0,"));
    }
}
