//! The first causes of what is wrong with a site: what else is odd often follows from them.

use serde::Serialize;

/// What kind of mistake a cause is, in the order in which one explains others: with the wrong unit no place is right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CauseKind {
    /// Another of the model's axes points up.
    UpAxis,
    /// The model is in another unit.
    Units,
    /// A probe or view stands where nothing can stand.
    Place,
    /// A picture is mirrored, upside down or another's.
    Picture,
    /// A picture was taken elsewhere, or in another direction.
    Pose,
}

/// A mistake in the site file that explains what is odd.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cause {
    /// What kind of mistake.
    pub kind: CauseKind,
    /// The key, or the probe or view, that it is in: `site.units`, `probe.west`.
    pub subject: String,
    /// What is wrong, by what that is known, and what to do.
    pub sentence: String,
}

impl Cause {
    /// A cause in the `what` (probe, view) of this name, of which a sentence on “it” tells.
    pub(super) fn of(kind: CauseKind, what: &str, name: &str, sentence: &str) -> Self {
        let [mut title, mut rest] = [what, sentence].map(str::chars);
        let title: String = title.next().into_iter().flat_map(char::to_uppercase).chain(title).collect();
        let first: String = rest.next().into_iter().flat_map(char::to_lowercase).collect();
        Self {
            kind,
            subject: format!("{what}.{name}"),
            sentence: format!("{title} “{name}”: {first}{}", rest.as_str()),
        }
    }
}

/// Causes in the order in which they explain each other, those of one kind as they come. Where units or axes are wrong,
/// no place is asked about: it would be wrong for that alone.
pub(super) fn ordered(mut causes: Vec<Cause>) -> Vec<Cause> {
    causes.sort_by_key(|c| c.kind);
    if causes.first().is_some_and(|c| c.kind <= CauseKind::Units) {
        causes.retain(|c| c.kind <= CauseKind::Units);
    }
    causes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_names_what_it_is_about() {
        let cause = Cause::of(CauseKind::Pose, "probe", "west", "Its picture is turned. Correct its heading.");
        assert_eq!(cause.subject, "probe.west");
        assert_eq!(cause.sentence, "Probe “west”: its picture is turned. Correct its heading.");
    }

    #[test]
    fn what_explains_the_rest_comes_first_and_alone() {
        let cause = |kind, subject: &str| Cause { kind, subject: subject.into(), sentence: String::new() };
        let subjects = |causes: Vec<Cause>| ordered(causes).into_iter().map(|c| c.subject).collect::<Vec<_>>();
        let places = vec![cause(CauseKind::Place, "probe.b"), cause(CauseKind::Place, "probe.a")];
        assert_eq!(subjects(places.clone()), ["probe.b", "probe.a"]);
        let with_units = [places, vec![cause(CauseKind::Units, "site.units"), cause(CauseKind::UpAxis, "site.up")]];
        assert_eq!(subjects(with_units.concat()), ["site.up", "site.units"]);
    }
}
