//! Suggestions for unknown names in errors: the nearest known name, and all known names.

/// Length of the longest names that are compared: comparing takes quadratic time, and longer names are not typos.
const LONGEST: usize = 200;

/// The known name closest to `name`, ignoring case, if it is close enough to be a typo. The first of several.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if name.is_empty() || name.len() > LONGEST {
        return None;
    }
    let name = name.to_lowercase();
    known
        .into_iter()
        .filter(|known| !known.is_empty() && known.len() <= LONGEST)
        .map(|known| (strsim::damerau_levenshtein(&name, &known.to_lowercase()), known))
        .filter(|(distance, known)| *distance <= 2.max(known.chars().count() / 3))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, known)| known)
}

/// The `count` known names that are most like `name`, ignoring case, the best first.
pub fn similar<'a>(name: &str, known: impl IntoIterator<Item = &'a str>, count: usize) -> Vec<&'a str> {
    let name: String = name.to_lowercase().chars().take(LONGEST).collect();
    let mut scored: Vec<(f64, &str)> =
        known.into_iter().map(|known| (strsim::jaro_winkler(&name, &known.to_lowercase()), known)).collect();
    scored.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    scored.into_iter().take(count).map(|(_, known)| known).collect()
}

/// `"; did you mean 'hip'?"`, or an empty text without a name.
pub fn did_you_mean(near: Option<impl AsRef<str>>) -> String {
    near.map(|near| format!("; did you mean '{}'?", near.as_ref())).unwrap_or_default()
}

/// `"; did you mean 'hip'? known: hip, knee"`, or `"; known: hip, knee"` without a name.
pub fn listed(near: Option<impl AsRef<str>>, known: &str) -> String {
    let end = if near.is_some() { "" } else { ";" };
    format!("{}{end} known: {known}", did_you_mean(near))
}

/// The text of [`listed`] for a name and all known names.
pub fn among<S: AsRef<str>>(name: &str, known: &[S]) -> String {
    let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
    listed(nearest(name, known.iter().copied()), &known.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hint_is_a_name_that_may_have_been_meant() {
        let known = ["hip", "Knee", "", "ankle_left", "ankle_right"];
        let near = |name| nearest(name, known);
        assert_eq!([near("hpi"), near("knee"), near("ankle_lfet")], [Some("hip"), Some("Knee"), Some("ankle_left")]);
        assert_eq!([near(""), near("shoulder"), near(&"hip".repeat(100))], [None; 3]);
    }

    #[test]
    fn similar_names_come_best_first() {
        let known = ["ankle_left", "hip", "Hip_left", "knee"];
        assert_eq!(similar("hipp", known, 2), ["hip", "Hip_left"]);
        assert_eq!(similar(&"x".repeat(1000), known, 9).len(), 4);
    }

    #[test]
    fn a_hint_fits_behind_a_sentence() {
        assert_eq!(among("hpi", &["hip", "knee"]), "; did you mean 'hip'? known: hip, knee");
        assert_eq!(among("shoulder", &["hip", "knee"]), "; known: hip, knee");
        assert_eq!(did_you_mean(None::<&str>), "");
    }
}
