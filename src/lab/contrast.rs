//! Two pictures of the same thing to be looked at against each other: a slider between them, and a map of their difference.
//!
//! The template `contrast.html` needs no script: without one (and on paper) the pictures stand side by side; `contrast.js` lays the
//! second over the first and puts a slider below, which keys move too.

use super::difference::Difference;
use super::page::number;
use crate::image::picture::Picture;
use crate::image::png;
use anyhow::ensure;
use serde::Serialize;

/// A pair of pictures of equal size, each with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Contrast {
    /// What one sees; may be empty.
    pub caption: String,
    /// The picture.
    pub a: (String, Picture),
    /// What it is held against.
    pub b: (String, Picture),
    /// The commands that make them, where they are known.
    pub commands: Vec<String>,
}

/// A contrast as the template `contrast.html` shows it; pictures are `data:` addresses.
#[derive(Clone, Debug, Serialize)]
pub struct ContrastView {
    caption: String,
    name_a: String,
    name_b: String,
    a: String,
    b: String,
    difference: String,
    /// Radiance of the full colour; absent if nothing differs.
    scale: Option<String>,
    commands: Vec<String>,
}

impl Contrast {
    /// The view; an error if the sizes differ.
    pub fn view(&self) -> anyhow::Result<ContrastView> {
        let [(name_a, a), (name_b, b)] = [&self.a, &self.b];
        ensure!(
            (a.width, a.height) == (b.width, b.height),
            "{name_a} and {name_b} have different sizes"
        );
        let uri = |bytes: Result<Vec<u8>, String>| {
            let bytes = bytes.map_err(anyhow::Error::msg)?;
            Ok::<_, anyhow::Error>(png::data_uri(&bytes))
        };
        let difference = Difference::of(a, b);
        Ok(ContrastView {
            caption: self.caption.clone(),
            name_a: name_a.clone(),
            name_b: name_b.clone(),
            a: uri(png::encode(a, 1.0))?,
            b: uri(png::encode(b, 1.0))?,
            difference: uri(difference.png())?,
            scale: (difference.scale > 0.0).then(|| number(difference.scale)),
            commands: self.commands.clone(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::page::fill;
    use super::*;

    fn picture(value: f32) -> Picture {
        Picture {
            width: 2,
            height: 1,
            rgb: vec![[value; 3], [0.5; 3]],
            ..Picture::default()
        }
    }

    fn page(contrast: &Contrast) -> String {
        let template = "{% from \"contrast.html\" import contrast %}{{ contrast(c) }}<script>{{ script|safe }}</script>";
        let view = contrast.view().unwrap();
        fill(template, std::collections::BTreeMap::from([("c", view)])).unwrap()
    }

    #[test]
    fn a_contrast_shows_both_pictures_the_difference_and_its_range() {
        let mut contrast = Contrast {
            caption: "The <cup>".to_owned(),
            a: ("new".to_owned(), picture(0.75)),
            b: ("golden".to_owned(), picture(0.5)),
            commands: vec!["photolathe render".to_owned()],
        };
        let html = page(&contrast);
        // Each once: the script takes its copy from the page.
        let encoded = |p: &Picture| png::data_uri(&png::encode(p, 1.0).unwrap());
        for (_, picture) in [&contrast.a, &contrast.b] {
            assert_eq!(html.matches(&encoded(picture)).count(), 1);
        }
        assert_eq!(html.matches("src=\"data:image/png").count(), 3);
        for word in [
            "−0.25",
            "+0.25",
            "W/(m² sr)",
            "new",
            "golden",
            "The &lt;cup&gt;",
            "render",
        ] {
            assert!(html.contains(word), "{word}");
        }
        assert!(!html.contains("http"), "the page needs a network");
        contrast.b.1 = contrast.a.1.clone();
        assert!(page(&contrast).contains("nothing differs"));
        contrast.b.1 = Picture::default();
        assert!(contrast.view().is_err());
    }
}
