//! Numbers of several seeds, and cells of a table.

/// Mean and standard deviation. A single number has no deviation.
pub type Spread = (f64, Option<f64>);

/// Mean and standard deviation, of the population.
pub fn spread(values: impl Iterator<Item = f64> + Clone) -> Spread {
    let count = values.clone().count();
    let n = count.max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    let deviation = (values.map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
    (mean, (count > 1).then_some(deviation))
}

/// `mean ± deviation`.
pub fn plus_minus((mean, deviation): Spread, decimals: usize) -> String {
    let deviation = deviation.map_or(String::new(), |deviation| format!(" ± {deviation:.decimals$}"));
    format!("{mean:.decimals$}{deviation}")
}

/// The median: the mean of the two middle numbers if their count is even. `None` without numbers.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let (low, high) = (values.len().checked_sub(1)? / 2, values.len() / 2);
    Some((values[low] + values[high]) / 2.0)
}

/// The median of the seeds' numbers. If the numbers differ, each follows in brackets.
pub fn cell(values: &[Option<f64>], text: &dyn Fn(f64) -> String) -> String {
    let known: Vec<f64> = values.iter().flatten().copied().collect();
    // without a number for each seed there is no median
    let middle = if known.len() == values.len() { median(known) } else { None };
    let middle = middle.map_or("-".into(), text);
    let each: Vec<String> = values.iter().map(|value| value.map_or("-".into(), text)).collect();
    let differ = each.iter().any(|text| *text != middle);
    if differ { format!("{middle} ({})", each.join(", ")) } else { middle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_are_of_the_population() {
        assert_eq!(spread([1.0, 3.0].into_iter()), (2.0, Some(1.0)));
        assert_eq!(plus_minus((2.0, Some(1.04)), 1), "2.0 ± 1.0");
        assert_eq!(plus_minus(spread([2.5].into_iter()), 1), "2.5");
    }

    #[test]
    fn medians_are_in_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }

    #[test]
    fn cells_show_the_seeds_that_differ() {
        let text = |x: f64| format!("{x:.0}");
        assert_eq!(cell(&[Some(3.0), Some(1.0), Some(2.0)], &text), "2 (3, 1, 2)");
        assert_eq!(cell(&[Some(3.0), Some(3.0)], &text), "3");
        assert_eq!(cell(&[Some(3.0), None], &text), "- (3, -)");
    }
}
