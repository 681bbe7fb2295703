//! The tally of operations: counts of the work that the code really did.
//!
//! Off unless a scope asks for it ([`tally`]): then a kernel (a whole product, a factorisation, a pivot)
//! adds its counts once, from the sizes that it ran with. Off, each kernel reads one flag. What is counted:
//!
//! * multiplications, divisions and roots among them; additions, subtractions among them. Adding to a sum
//!   that has no term yet is a move and not counted, so a scalar product of k terms has k − 1 additions;
//! * comparisons of sorts and selections, by counting in the comparison itself;
//! * linear programs, their pivots and bound flips; constraints eliminated, columns absorbed or boxed;
//! * what the same programs and eliminations cost under the model of [Rego2020, Appendix]: N_d N_c³ a program
//!   of N_d variables and N_c constraints, the 2 N_d bounds counted as N_d; (n_g + n_c)³ an elimination;
//! * n³ for each eigen-decomposition or singular value decomposition of the library, which iterates.
//!
//! Not counted: function evaluations and automatic differentiation, whose cost is the model's, and vectors of
//! rounding bounds that cost less than the product they belong to.
//!
//! Counts are kept by stage of a step and, within it, by kernel: an inner scope wins over an outer one.
//! A tally belongs to its thread.

use std::cell::RefCell;
use std::ops::AddAssign;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Part of a step of an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Outside any of the others.
    Rest,
    /// Order reduction, constraint elimination among it.
    Reduction,
    /// The image under the dynamics.
    Prediction,
    /// The gain of the update.
    Gain,
    /// What a measurement changes, without the gain.
    Update,
    /// The interval hull or confidence box.
    Hull,
}

impl Stage {
    /// All stages.
    pub const ALL: [Self; 6] = [
        Self::Rest,
        Self::Reduction,
        Self::Prediction,
        Self::Gain,
        Self::Update,
        Self::Hull,
    ];
}

/// What kind of kernel did the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kernel {
    /// Products, sums, factorisations.
    Plain,
    /// Linear programs.
    Program,
    /// Elimination of constraints.
    Elimination,
}

impl Kernel {
    /// All kernels.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Program, Self::Elimination];
}

/// Counts of operations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Multiplications, divisions and roots.
    pub multiplications: u64,
    /// Additions and subtractions.
    pub additions: u64,
    /// Comparisons of sorts and selections.
    pub comparisons: u64,
    /// Linear programs.
    pub programs: u64,
    /// Pivots of the simplex, those of rebuilt tableaus included.
    pub pivots: u64,
    /// Variables that went to their other bound without a pivot.
    pub flips: u64,
    /// Linear programs in which the simplex gave up before its optimum.
    pub unfinished: u64,
    /// Linear programs given to the interior-point solver besides; its bits may depend on the processor.
    pub fallbacks: u64,
    /// Constraints eliminated.
    pub eliminations: u64,
    /// Σ N_d (N_d + rows)³ over the linear programs.
    pub program_model: u128,
    /// Σ (n_g + n_c)³ over the eliminations.
    pub elimination_model: u128,
    /// Σ n³ over the decompositions that the library iterates for.
    pub decomposition_cubes: u64,
}

impl Counts {
    /// Multiplications and additions.
    pub fn arithmetic(&self) -> u64 {
        self.multiplications + self.additions
    }
}

impl AddAssign for Counts {
    fn add_assign(&mut self, other: Self) {
        self.multiplications += other.multiplications;
        self.additions += other.additions;
        self.comparisons += other.comparisons;
        self.programs += other.programs;
        self.pivots += other.pivots;
        self.flips += other.flips;
        self.unfinished += other.unfinished;
        self.fallbacks += other.fallbacks;
        self.eliminations += other.eliminations;
        self.program_model += other.program_model;
        self.elimination_model += other.elimination_model;
        self.decomposition_cubes += other.decomposition_cubes;
    }
}

/// The counts of a scope, by stage and kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    counts: [[Counts; Kernel::ALL.len()]; Stage::ALL.len()],
}

impl Tally {
    /// The counts of one stage and kernel.
    pub fn of(&self, stage: Stage, kernel: Kernel) -> Counts {
        self.counts[stage as usize][kernel as usize]
    }

    /// The counts of one stage.
    pub fn stage(&self, stage: Stage) -> Counts {
        self.sum(&[stage], &Kernel::ALL)
    }

    /// The counts of one kernel.
    pub fn kernel(&self, kernel: Kernel) -> Counts {
        self.sum(&Stage::ALL, &[kernel])
    }

    /// All counts.
    pub fn total(&self) -> Counts {
        self.sum(&Stage::ALL, &Kernel::ALL)
    }

    fn sum(&self, stages: &[Stage], kernels: &[Kernel]) -> Counts {
        let mut sum = Counts::default();
        for &stage in stages {
            for &kernel in kernels {
                sum += self.of(stage, kernel);
            }
        }
        sum
    }
}

/// What a thread counts into.
struct Open {
    tally: Tally,
    stage: Stage,
    kernel: Kernel,
    clock: Option<Clock>,
}

/// A caller's clock, read where the stage changes.
struct Clock {
    now: fn() -> u64,
    since: u64,
    spent: StageTimes,
}

impl Clock {
    /// What has passed since it was last read goes to `stage`.
    fn charge(&mut self, stage: Stage) {
        let now = (self.now)();
        self.spent.0[stage as usize] += now.saturating_sub(self.since);
        self.since = now;
    }
}

impl Open {
    fn switch(&mut self, stage: Stage, kernel: Kernel) {
        if stage != self.stage
            && let Some(clock) = &mut self.clock
        {
            clock.charge(self.stage);
        }
        (self.stage, self.kernel) = (stage, kernel);
    }
}

/// What a clock said of each stage, in its own unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageTimes([u64; Stage::ALL.len()]);

impl StageTimes {
    /// The time in `stage`, without that in stages within it.
    pub fn of(&self, stage: Stage) -> u64 {
        self.0[stage as usize]
    }
}

/// Threads that have a tally open; a kernel looks no further while there is none.
static OPEN: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static HERE: RefCell<Vec<Open>> = const { RefCell::new(Vec::new()) };
}

/// Runs `work` with the tally on and returns what it counted on this thread.
///
/// Tallies nest: the outer one counts what the inner ones did as well.
pub fn tally<T>(work: impl FnOnce() -> T) -> (T, Tally) {
    let (result, tally, _) = opened(None, work);
    (result, tally)
}

/// Runs `work` and returns how long it was in each stage by `clock`, which is the caller's: none is in here.
///
/// The tally is on meanwhile and costs a little in every kernel. What an inner tally does counts to the stage that it
/// was opened in.
pub fn clocked<T>(clock: fn() -> u64, work: impl FnOnce() -> T) -> (T, StageTimes) {
    let (result, _, times) = opened(Some(clock), work);
    (result, times)
}

fn opened<T>(clock: Option<fn() -> u64>, work: impl FnOnce() -> T) -> (T, Tally, StageTimes) {
    /// Closes the tally also where `work` panics.
    struct Scope;
    impl Drop for Scope {
        fn drop(&mut self) {
            OPEN.fetch_sub(1, Ordering::Relaxed);
            HERE.with_borrow_mut(|open| {
                let Some(inner) = open.pop() else { return };
                if let Some(outer) = open.last_mut() {
                    for (to, from) in outer.tally.counts.iter_mut().zip(inner.tally.counts) {
                        to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
                    }
                }
            });
        }
    }
    HERE.with_borrow_mut(|open| {
        let (stage, kernel) = open
            .last()
            .map_or((Stage::Rest, Kernel::Plain), |o| (o.stage, o.kernel));
        open.push(Open {
            tally: Tally::default(),
            stage,
            kernel,
            clock: clock.map(|now| Clock {
                now,
                since: now(),
                spent: StageTimes::default(),
            }),
        });
    });
    OPEN.fetch_add(1, Ordering::Relaxed);
    let scope = Scope;
    let result = work();
    let (tally, times) = HERE.with_borrow_mut(|open| {
        let Some(open) = open.last_mut() else {
            return Default::default();
        };
        let times = open.clock.as_mut().map(|clock| {
            clock.charge(open.stage);
            clock.spent
        });
        (open.tally, times.unwrap_or_default())
    });
    drop(scope);
    (result, tally, times)
}

/// Until it is dropped, counts go to another stage or kernel.
#[must_use = "counts go to the stage while the scope lives"]
#[derive(Debug)]
pub struct Within {
    before: Option<(Stage, Kernel)>,
}

impl Drop for Within {
    fn drop(&mut self) {
        if let Some((stage, kernel)) = self.before {
            HERE.with_borrow_mut(|open| {
                if let Some(open) = open.last_mut() {
                    open.switch(stage, kernel);
                }
            });
        }
    }
}

/// Counts go to `stage` while the scope lives.
#[inline]
pub fn stage(stage: Stage) -> Within {
    within(|_, kernel| (stage, kernel))
}

/// Counts go to `kernel` while the scope lives.
#[inline]
pub fn kernel(kernel: Kernel) -> Within {
    within(|stage, _| (stage, kernel))
}

#[inline]
fn within(change: impl FnOnce(Stage, Kernel) -> (Stage, Kernel)) -> Within {
    if !on() {
        return Within { before: None };
    }
    HERE.with_borrow_mut(|open| Within {
        before: open.last_mut().map(|open| {
            let before = (open.stage, open.kernel);
            let (stage, kernel) = change(before.0, before.1);
            open.switch(stage, kernel);
            before
        }),
    })
}

/// True if some thread counts.
#[inline(always)]
pub(crate) fn on() -> bool {
    OPEN.load(Ordering::Relaxed) != 0
}

#[cold]
#[inline(never)]
fn add(change: impl FnOnce(&mut Counts)) {
    HERE.with_borrow_mut(|open| {
        if let Some(open) = open.last_mut() {
            change(&mut open.tally.counts[open.stage as usize][open.kernel as usize]);
        }
    });
}

/// A kernel made `multiplications` and `additions`.
#[inline(always)]
pub fn count(multiplications: usize, additions: usize) {
    if on() {
        add(|c| {
            c.multiplications += multiplications as u64;
            c.additions += additions as u64;
        });
    }
}

/// A kernel made the multiplications and additions that `work` says, which is asked only where it matters.
#[inline(always)]
pub(crate) fn count_of(work: impl FnOnce() -> (usize, usize)) {
    if on() {
        let (multiplications, additions) = work();
        count(multiplications, additions);
    }
}

/// A sort or selection made `comparisons`.
#[inline(always)]
pub(crate) fn compared(comparisons: usize) {
    if on() {
        add(|c| c.comparisons += comparisons as u64);
    }
}

/// A linear program of `cols` variables in [−1, 1] and `rows` equations is solved.
#[inline(always)]
pub(crate) fn program(rows: usize, cols: usize) {
    if on() {
        add(|c| {
            c.programs += 1;
            c.program_model += cols as u128 * ((rows + cols) as u128).pow(3);
        });
    }
}

/// The simplex made one pivot; `flips` variables changed their bound on the way.
#[inline(always)]
pub(crate) fn pivot(flips: usize) {
    if on() {
        add(|c| {
            c.pivots += 1;
            c.flips += flips as u64;
        });
    }
}

/// The simplex gave up.
#[inline(always)]
pub(crate) fn unfinished() {
    if on() {
        add(|c| c.unfinished += 1);
    }
}

/// The interior-point solver is asked.
#[inline(always)]
pub(crate) fn fallback() {
    if on() {
        add(|c| c.fallbacks += 1);
    }
}

/// One of `rows` constraints on `cols` generators is eliminated.
#[inline(always)]
pub(crate) fn elimination(rows: usize, cols: usize) {
    if on() {
        add(|c| {
            c.eliminations += 1;
            c.elimination_model += ((rows + cols) as u128).pow(3);
        });
    }
}

/// The library decomposed a matrix of `rows` × `cols`.
#[inline(always)]
pub(crate) fn decomposition(rows: usize, cols: usize) {
    if on() {
        add(|c| c.decomposition_cubes += (rows.max(cols) * rows.min(cols).pow(2)) as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_go_to_the_innermost_stage_and_to_every_open_tally() {
        count(1000, 1000);
        let ((_, inner), outer) = tally(|| {
            count(1, 0);
            let _stage = stage(Stage::Update);
            count(10, 0);
            tally(|| {
                count(100, 1);
                let _stage = stage(Stage::Gain);
                let _kernel = kernel(Kernel::Program);
                program(2, 3);
            })
        });
        assert_eq!(outer.of(Stage::Rest, Kernel::Plain).multiplications, 1);
        assert_eq!(outer.stage(Stage::Update).multiplications, 110);
        assert_eq!(inner.stage(Stage::Update).arithmetic(), 101);
        assert_eq!(inner.of(Stage::Gain, Kernel::Program).programs, 1);
        assert_eq!(outer.kernel(Kernel::Program).program_model, 3 * 125);
        assert_eq!(outer.total().multiplications, 111);
    }

    #[test]
    fn a_scope_ends_with_a_panic_and_a_thread_counts_for_itself() {
        let caught = std::panic::catch_unwind(|| tally(|| panic!("in the scope")));
        assert!(caught.is_err());
        let ((), here) = tally(|| {
            std::thread::spawn(|| count(5, 5))
                .join()
                .expect("the thread only counts");
            count(1, 2);
        });
        assert_eq!(here.total().arithmetic(), 3);
    }

    #[test]
    fn a_clock_is_read_where_the_stage_changes() {
        thread_local! {
            static NOW: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
        }
        let pass = |n: u64| NOW.set(NOW.get() + n);
        let (result, times) = clocked(
            || NOW.get(),
            || {
                pass(1);
                {
                    let _stage = stage(Stage::Update);
                    pass(10);
                    {
                        let _stage = stage(Stage::Reduction);
                        let _kernel = kernel(Kernel::Program);
                        pass(100);
                    }
                    pass(20);
                }
                pass(2);
                "done"
            },
        );
        let of = [Stage::Rest, Stage::Update, Stage::Reduction, Stage::Gain];
        assert_eq!(of.map(|stage| times.of(stage)), [3, 30, 100, 0]);
        assert_eq!(result, "done");
    }
}
