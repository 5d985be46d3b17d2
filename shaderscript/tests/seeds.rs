//! The seeds of the fuzz target `shaderscript`, and mutations of them, through the function that the target calls.

use survive::survive;

#[path = "../../fuzz/mutate.rs"]
mod mutate;
#[path = "common/survive.rs"]
mod survive;

#[test]
fn seeds_and_mutations_of_them_survive() {
    let (taken, refused) = mutate::run("shaderscript", 5000, |text| survive(text, 1.25));
    assert!(taken > 1000, "{taken} taken, {refused} refused");
}
