//! Resolves the roles of a task from names to index ranges, and checks them.

use std::ops::Range;

use crate::agent::{Facts, RoleFacts};
use crate::shard::{Role, Spec};

/// Index ranges of all roles in a task.
///
/// # Errors
/// States what is wrong with the agent's facts.
pub(super) fn of(facts: &Facts, spec: &Spec) -> Result<Vec<Role>, String> {
    if facts.roles.is_empty() {
        return Ok(Vec::new());
    }
    if facts.termination_reward.is_some() {
        return Err("it has roles and a termination_reward, expected None: use a term of each role for failures".into());
    }
    let groups: Vec<&str> = spec.observations.iter().map(|group| group.name.as_str()).collect();
    let actions: Vec<&str> = spec.action_names.iter().map(String::as_str).collect();
    let terms: Vec<&str> = spec.reward_terms.iter().map(String::as_str).collect();
    let mut out: Vec<Role> = Vec::new();
    for RoleFacts { name, observations, actions: moves, reward_terms, intermittent } in &facts.roles {
        let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if name.is_empty() || !name.chars().all(fits) || out.iter().any(|other| other.name == *name) {
            return Err(format!("a role is called '{name}', expected a unique name of letters, digits, '-' and '_'"));
        }
        let place = |what: &str, all: &[&str], own: &[String]| {
            run(all, own).ok_or_else(|| {
                format!("the {what} of its role '{name}' are {own:?}, expected adjacent ones of {all:?}")
            })
        };
        let seen = place("observations", &groups, observations)?;
        let obs = spec.observations[seen.start].range.start..spec.observations[seen.end - 1].range.end;
        let (act, terms) = (place("actions", &actions, moves)?, place("reward terms", &terms, reward_terms)?);
        out.push(Role { name: name.clone(), obs, act, terms, intermittent: *intermittent });
    }
    whole("actuator", &actions, out.iter().map(|role| role.act.clone()).collect())?;
    whole("reward term", &terms, out.iter().map(|role| role.terms.clone()).collect())?;
    match out.windows(2).find(|pair| pair[0].terms.end != pair[1].terms.start) {
        None => Ok(out),
        Some(pair) => {
            Err(format!("the reward terms of its role '{}' do not follow those of '{}'", pair[1].name, pair[0].name))
        }
    }
}

/// Index range of adjacent names in a list.
fn run(all: &[&str], own: &[String]) -> Option<Range<usize>> {
    let start = all.iter().position(|name| Some(*name) == own.first().map(String::as_str))?;
    let range = start..start + own.len();
    all.get(range.clone())?.iter().zip(own).all(|(a, b)| a == b).then_some(range)
}

/// Checks that each name of a list belongs to exactly one role.
fn whole(what: &str, all: &[&str], ranges: Vec<Range<usize>>) -> Result<(), String> {
    for (i, name) in all.iter().enumerate() {
        let roles = ranges.iter().filter(|range| range.contains(&i)).count();
        if roles != 1 {
            return Err(format!("its {what} '{name}' has {roles} roles, expected one"));
        }
    }
    Ok(())
}
