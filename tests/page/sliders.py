"""Sliders of pairs of pictures: each follows keys and script, and parts its pictures where it stands."""
from browser import ARROW_LEFT, ARROW_RIGHT, END

SLIDER_STATE = """
const pair = document.querySelectorAll('.pair')[arguments[0]], after = pair.querySelector('.after');
return {value: pair.querySelector('input').value, clip: getComputedStyle(after).clipPath,
        says: pair.querySelector('input').getAttribute('aria-valuetext') || ''};"""

# Sets a slider, and tells the two parts of its pictures left and right of their middle that no thumb covers.
PLACE_SLIDER = """
const pair = document.querySelectorAll('.pair')[arguments[0]], slider = pair.querySelector('input');
slider.value = arguments[1];
slider.dispatchEvent(new Event('input'));
pair.scrollIntoView({block: 'center'});
const {left, top, width, height} = pair.getBoundingClientRect();
return [0.1, 0.6].map(at => ({x: Math.round(scrollX + left + at * width), y: Math.round(scrollY + top + 2),
                              width: Math.floor(0.3 * width), height: Math.floor(0.3 * height)}));"""


def check_pictures_of_slider(browser, name, index, checks):
    """Left of the edge is the one picture, right of it the other, and they differ."""
    at = {place: [browser.png_of(part) for part in browser.run(PLACE_SLIDER, index, place)] for place in (0, 50, 100)}
    (left_after, right_after), (left, right), (left_before, right_before) = at[0], at[50], at[100]
    same = {"left as before": left == left_before, "right as after": right == right_after,
            "left as after": left == left_after, "right as before": right == right_before}
    checks.expect(name, "two pictures that meet at the edge", list(same.values()) == [True, True, False, False], same)


def check_slider(browser, page, index, checks):
    name = f"{page}, slider {index + 1}"

    def clip(at):
        return f"inset(0px 0px 0px {at}%)"

    def expect(what, value):
        state = browser.run(SLIDER_STATE, index)
        checks.expect(name, f"{what} to show {value} %", state["value"] == str(value) and
                      state["clip"] == clip(value) and state["says"].startswith(f"{value} % "), state)

    expect("the slider at first", 50)
    browser.type(".pair input", index, ARROW_RIGHT)
    expect("an arrow key", 51)
    browser.press(ARROW_LEFT)
    browser.press(ARROW_LEFT)
    expect("two arrow keys back", 49)
    browser.press(END)
    expect("the End key", 100)
    check_pictures_of_slider(browser, name, index, checks)


def check_sliders(browser, name, checks):
    for index in range(browser.run("return document.querySelectorAll('.pair input').length")):
        check_slider(browser, name, index, checks)
    shown = browser.run("return [...document.images].map(i => i.complete && i.naturalWidth)")
    checks.expect(name, "all pictures to be decoded", len(shown) > 0 and all(shown), shown)
