//! Numbered pictures: `west_####.exr` for a video of light.

use std::path::{Path, PathBuf};

/// Whether a name's last part holds # in the place of digits.
pub(super) fn is_numbered(name: &str) -> bool {
    split(name).is_some()
}

/// What comes before and after the one run of #, and how long that is.
fn split(name: &str) -> Option<(&str, &str, usize)> {
    let last = name.rfind(['/', '\\']).map_or(0, |i| i + 1);
    let start = last + name[last..].find('#')?;
    let length = name[start..].chars().take_while(|c| *c == '#').count();
    let (before, after) = (&name[..start], &name[start + length..]);
    (!after.contains('#')).then_some((before, after, length))
}

/// The files that a numbered name means, by number: digits, at least as many as there are #, follow each other from the first
/// file's number on.
///
/// # Errors
///
/// Why there are none, or which is missing.
pub(super) fn numbered(folder: &Path, name: &str) -> Result<Vec<PathBuf>, String> {
    let (before, after, length) = split(name).ok_or_else(|| format!("“{name}” holds no number"))?;
    let path = folder.join(before);
    // `before` may end with a folder's name
    let (folder, start) = match before.ends_with(['/', '\\']) || before.is_empty() {
        true => (path.as_path(), String::new()),
        false => (path.parent().unwrap_or(folder), path.file_name().unwrap_or_default().to_string_lossy().into_owned()),
    };
    let files = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let number = |file: &str| -> Option<u32> {
        let digits = file.strip_prefix(&start)?.strip_suffix(after)?;
        let plain = digits.bytes().all(|b| b.is_ascii_digit());
        let as_long = digits.len() == length || digits.len() > length && !digits.starts_with('0');
        (plain && as_long).then(|| digits.parse().ok()).flatten()
    };
    let names = files.filter_map(|f| f.ok()?.file_name().into_string().ok());
    let mut all: Vec<(u32, PathBuf)> = names.filter_map(|f| Some((number(&f)?, folder.join(&f)))).collect();
    all.sort();
    if all.is_empty() {
        return Err(format!("there is no picture “{name}” with digits for {}", "#".repeat(length)));
    }
    if let Some(pair) = all.windows(2).find(|w| w[1].0 != w[0].0 + 1) {
        return Err(format!("of the pictures “{name}” number {} is missing", pair[0].0 + 1));
    }
    Ok(all.into_iter().map(|f| f.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_follow_each_other() {
        let folder = tempfile::tempdir().unwrap();
        let make = |name: &str| std::fs::write(folder.path().join(name), "").unwrap();
        for name in ["a_008.exr", "a_009.exr", "a_010.exr", "a_x11.exr", "a_0011.exr", "b_1.exr", "a_010.png"] {
            make(name);
        }
        let names = |name| -> Result<Vec<String>, String> {
            let all = numbered(folder.path(), name)?;
            Ok(all.iter().map(|p| p.file_name().unwrap().to_string_lossy().into_owned()).collect())
        };
        assert_eq!(names("a_###.exr").unwrap(), ["a_008.exr", "a_009.exr", "a_010.exr"]);
        assert_eq!(names("b_#.exr").unwrap(), ["b_1.exr"]);
        assert!(names("c_#.exr").is_err() && names("a_#_#.exr").is_err());
        make("a_012.exr");
        assert!(names("a_###.exr").unwrap_err().contains("number 11 is missing"));
        // past the last of so many digits numbers grow longer
        make("b_2.exr");
        (3..=11).for_each(|i| make(&format!("b_{i}.exr")));
        assert_eq!(names("b_#.exr").unwrap().len(), 11);
    }
}
