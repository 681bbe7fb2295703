//! A claim, its trials, and the verdict that follows from them.

use crate::exact::Source;

/// Whose sentence a claim is, and so what a loss of it says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Class {
    /// The paper's sentence under its own hypotheses, read as kindly as the text allows: a loss refutes it.
    #[default]
    Stated,
    /// A slip of the pen, which the paper's own proof or a neighbouring equation corrects.
    Slip,
    /// The sentence as our damaged text has it: lost or exchanged bars, lost subscripts. Never charged to the authors.
    Damage,
    /// A remark of ours that the paper does not make; outside of every count.
    Remark,
}

impl Class {
    /// Its name in the lake.
    pub fn name(self) -> &'static str {
        match self {
            Class::Stated => "stated",
            Class::Slip => "slip",
            Class::Damage => "damage",
            Class::Remark => "remark",
        }
    }
}

/// A claim made wrong on purpose: the same trials with one term dropped or shrunk. They must lose, or the trials
/// of the claim could not have refuted it.
#[derive(Clone, Copy)]
pub struct Twin {
    /// What was damaged.
    pub damage: &'static str,
    /// Tries the damaged claim.
    pub run: fn(&mut Trial),
}

/// A claim of a paper, and how it is tried.
#[derive(Clone)]
pub struct Claim {
    /// The paper's name.
    pub paper: &'static str,
    /// The claim's name, one within its paper.
    pub id: &'static str,
    /// What the paper says, shortened.
    pub statement: &'static str,
    /// What follows for a method that uses it.
    pub consequence: &'static str,
    /// Whose sentence it is.
    pub class: Class,
    /// Tries it.
    pub run: fn(&mut Trial),
    /// Damaged twins, each of which must lose; tests run them.
    pub twins: Vec<Twin>,
}

/// What the trials of a claim say, and of whom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every trial held.
    Holds,
    /// The claim is an equality, of which only the inequality held in every trial.
    HoldsAsBound,
    /// At least one trial failed.
    DoesNotHold,
    /// There was no trial.
    NotTested,
    /// At least one trial failed, of a slip of the pen that the paper itself corrects.
    Slip,
    /// At least one trial failed, of the sentence as our damaged text has it.
    Damaged,
    /// A remark of ours, whatever its trials gave.
    Remark,
}

impl Verdict {
    /// Its name in the lake.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Holds => "holds",
            Verdict::HoldsAsBound => "holds_as_bound",
            Verdict::DoesNotHold => "does_not_hold",
            Verdict::NotTested => "not_tested",
            Verdict::Slip => "slip",
            Verdict::Damaged => "damaged",
            Verdict::Remark => "remark",
        }
    }
}

/// What the trials of a claim gave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Follows from the counts alone; [`Claim::verdict`] says it of whose sentence it is.
    pub verdict: Verdict,
    /// Trials of the claim as printed.
    pub trials: u64,
    /// Trials in which it failed.
    pub lost: u64,
    /// The smallest counterexample, exact; empty if there is none.
    pub counterexample: String,
    /// Trials of the repaired claim.
    pub repaired_trials: u64,
    /// Trials in which the repaired claim failed.
    pub repaired_lost: u64,
}

/// Where a claim is tried: a source of instances, and the counts.
pub struct Trial {
    /// Instances, by counter.
    pub draw: Source,
    trials: u64,
    lost: u64,
    unequal: u64,
    counterexample: String,
    repaired: (u64, u64),
}

impl Trial {
    /// Counts a trial of the claim as printed.
    pub fn check(&mut self, holds: bool) {
        self.trials += 1;
        self.lost += u64::from(!holds);
    }

    /// Counts a trial, and keeps the first one that fails as the counterexample.
    pub fn check_or(&mut self, holds: bool, instance: impl FnOnce() -> String) {
        self.check(holds);
        if !holds && self.counterexample.is_empty() {
            self.counterexample = instance();
        }
    }

    /// Counts a trial of a claim of equality: whether the two sides are equal, and whether the inequality
    /// that remains holds.
    pub fn equality(&mut self, equal: bool, bounds: bool, instance: impl FnOnce() -> String) {
        self.trials += 1;
        self.lost += u64::from(!bounds);
        self.unequal += u64::from(!equal);
        if !(equal && bounds) && self.counterexample.is_empty() {
            self.counterexample = instance();
        }
    }

    /// Counts a trial of the repaired claim.
    pub fn repaired(&mut self, holds: bool) {
        self.repaired.0 += 1;
        self.repaired.1 += u64::from(!holds);
    }
}

impl Claim {
    /// The same claim as a sentence of another class.
    pub fn class(mut self, class: Class) -> Self {
        self.class = class;
        self
    }

    /// The same claim with one more damaged twin.
    pub fn twin(mut self, damage: &'static str, run: fn(&mut Trial)) -> Self {
        self.twins.push(Twin { damage, run });
        self
    }

    /// Tries a damaged twin on the instances of the claim itself.
    pub fn outcome_of(&self, twin: &Twin) -> Outcome {
        Claim {
            run: twin.run,
            ..self.clone()
        }
        .outcome()
    }

    /// Tries the claim. The same claim gives the same outcome, whatever ran before it.
    pub fn outcome(&self) -> Outcome {
        let mut trial = Trial {
            draw: Source::of(self.paper, self.id),
            trials: 0,
            lost: 0,
            unequal: 0,
            counterexample: String::new(),
            repaired: (0, 0),
        };
        (self.run)(&mut trial);
        let verdict = if trial.lost > 0 {
            Verdict::DoesNotHold
        } else if trial.unequal > 0 {
            Verdict::HoldsAsBound
        } else if trial.trials > 0 {
            Verdict::Holds
        } else {
            Verdict::NotTested
        };
        Outcome {
            verdict,
            trials: trial.trials,
            lost: trial.lost.max(trial.unequal),
            counterexample: trial.counterexample,
            repaired_trials: trial.repaired.0,
            repaired_lost: trial.repaired.1,
        }
    }

    /// What `outcome` says of the claim, whose sentence it is considered: a slip or a damage that loses is called that,
    /// and a remark of ours is one whether it loses or not.
    pub fn verdict(&self, outcome: &Outcome) -> Verdict {
        let fails = matches!(
            outcome.verdict,
            Verdict::DoesNotHold | Verdict::HoldsAsBound
        );
        match (self.class, outcome.verdict) {
            (_, Verdict::NotTested) => Verdict::NotTested,
            (Class::Remark, _) => Verdict::Remark,
            (Class::Slip, _) if fails => Verdict::Slip,
            (Class::Damage, _) if fails => Verdict::Damaged,
            (_, verdict) => verdict,
        }
    }

    /// The consequence, with the counts of the repaired claim.
    pub fn consequence(&self, outcome: &Outcome) -> String {
        if outcome.repaired_trials == 0 {
            return self.consequence.to_owned();
        }
        format!(
            "{}{}repaired: {} of {} lost",
            self.consequence,
            if self.consequence.is_empty() {
                ""
            } else {
                "; "
            },
            outcome.repaired_lost,
            outcome.repaired_trials
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(run: fn(&mut Trial)) -> Outcome {
        Claim {
            paper: "test",
            id: "verdict",
            statement: "",
            consequence: "do",
            class: Class::Stated,
            run,
            twins: Vec::new(),
        }
        .outcome()
    }

    #[test]
    fn the_verdict_follows_from_the_trials() {
        assert_eq!(verdict(|_| ()).verdict, Verdict::NotTested);
        assert_eq!(verdict(|t| t.check(true)).verdict, Verdict::Holds);
        let bound = verdict(|t| {
            t.equality(true, true, String::new);
            t.equality(false, true, || "here".to_owned());
        });
        assert_eq!((bound.verdict, bound.lost), (Verdict::HoldsAsBound, 1));
        let lost = verdict(|t| {
            t.check_or(false, || "first".to_owned());
            t.check_or(false, || "second".to_owned());
            t.equality(false, true, String::new);
            t.repaired(true);
        });
        assert_eq!(
            (lost.verdict, lost.lost, lost.trials),
            (Verdict::DoesNotHold, 2, 3)
        );
        assert_eq!(lost.counterexample, "first");
    }

    #[test]
    fn a_loss_says_what_the_class_of_the_sentence_says() {
        let of = |class: Class, run: fn(&mut Trial)| {
            let claim = Claim {
                paper: "test",
                id: "class",
                statement: "",
                consequence: "",
                class,
                run,
                twins: Vec::new(),
            };
            claim.verdict(&claim.outcome())
        };
        let loses: fn(&mut Trial) = |t| t.check(false);
        let holds: fn(&mut Trial) = |t| t.check(true);
        assert_eq!(of(Class::Stated, loses), Verdict::DoesNotHold);
        assert_eq!(of(Class::Slip, loses), Verdict::Slip);
        assert_eq!(of(Class::Damage, loses), Verdict::Damaged);
        assert_eq!(of(Class::Remark, loses), Verdict::Remark);
        assert_eq!(of(Class::Remark, holds), Verdict::Remark);
        for class in [Class::Stated, Class::Slip, Class::Damage] {
            assert_eq!(of(class, holds), Verdict::Holds);
        }
        assert_eq!(of(Class::Remark, |_| ()), Verdict::NotTested);
    }
}
