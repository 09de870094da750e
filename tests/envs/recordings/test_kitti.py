"""A KITTI-style folder is read as written, and refused by file and line where it is wrong."""

from collections.abc import Callable
from pathlib import Path
from shutil import copytree

import cv2
import numpy as np
import pytest

from grouser.envs.recordings.kitti import Image, open_kitti, write_kitti_recording
from grouser.geometry import Array, rotation_from_rpy, transform
from grouser.rig import Rig, StereoCamera, camera_mount

N, WIDTH, HEIGHT = 5, 48, 40
STEREO = StereoCamera(
    fx=50.0,
    fy=50.0,
    cx=23.5,
    cy=19.5,
    baseline=0.12,
    width=WIDTH,
    height=HEIGHT,
    T_base_camera=camera_mount(),
    disparity_offset=0.25,
)


def images(seed: int) -> list[Image]:
    pixels = np.random.default_rng(seed).integers(0, 256, (N, HEIGHT, WIDTH), dtype=np.uint8)
    return list(pixels)


def camera_poses() -> Array:
    turns = np.array([rotation_from_rpy(0, 0.02 * k, 0.01 * k) for k in range(N)])
    return transform(turns, np.arange(N)[:, None] * np.array([0.01, -0.02, 0.3]))


@pytest.fixture(scope="module")
def pristine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pristine") / "log"
    stamps = 7.0 + np.linspace(0.0, 0.2 * (N - 1), N)
    left, right = images(0), images(1)
    write_kitti_recording(
        folder, Rig(dt=0.2, stereo=STEREO), left, right, poses=camera_poses(), stamps=stamps
    )
    return folder


@pytest.fixture
def folder(pristine: Path, tmp_path: Path) -> Path:
    return Path(copytree(pristine, tmp_path / "log"))


def test_what_was_written_is_read(folder: Path) -> None:
    recording = open_kitti(folder)
    stereo = recording.rig.stereo
    assert stereo is not None and recording.poses is not None
    assert len(recording) == N
    assert recording.rig.dt == pytest.approx(0.2)
    np.testing.assert_allclose(recording.stamps, 0.2 * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(recording.poses, camera_poses(), atol=1e-9)
    for name in ("fx", "fy", "cx", "cy", "baseline", "width", "height", "disparity_offset"):
        assert getattr(stereo, name) == pytest.approx(getattr(STEREO, name)), name
    assert (stereo.mount_sigma > 0).all(), "a recording does not say where its camera is"
    for paths, written in ((recording.left, images(0)), (recording.right, images(1))):
        for path, image in zip(paths, written, strict=True):
            np.testing.assert_array_equal(recording.image(path, color=False)[:, :, 0], image)


def test_color_images_are_read_as_rgb_or_grey(folder: Path) -> None:
    red = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    red[:, :, 0] = 255
    write_kitti_recording(folder, Rig(dt=0.1, stereo=STEREO), [red] * N, [red] * N)
    recording = open_kitti(folder)
    np.testing.assert_array_equal(recording.image(recording.left[0], color=True), red)
    grey = recording.image(recording.left[0], color=False)
    assert grey.shape == (HEIGHT, WIDTH, 1)
    assert 70 < grey[0, 0, 0] < 80, "red is 30 % of the luminance"


def test_without_times_and_poses(folder: Path) -> None:
    (folder / "times.txt").unlink()
    (folder / "poses.txt").unlink()
    recording = open_kitti(folder)
    assert recording.poses is None
    assert recording.rig.dt == 0.1
    np.testing.assert_allclose(recording.stamps, 0.1 * np.arange(N))


def test_frames_are_ordered_by_number(folder: Path) -> None:
    for side in ("image_l", "image_r"):
        for index, path in enumerate(sorted((folder / side).iterdir())):
            path.rename(folder / side / f"{index + 8}.png")
    assert [path.stem for path in open_kitti(folder).left] == ["8", "9", "10", "11", "12"]


def kitti_row(fx: float, tx: float, tz: float = 0.0) -> str:
    return f"{fx} 0 23.5 {tx} 0 {fx} 19.5 0 0 0 1 {tz}"


FOUR_ROWS = [kitti_row(50, 0), kitti_row(50, -6), kitti_row(50, 3), kitti_row(50, -7)]
NAMED = "".join(f"P{i}: {row}\n" for i, row in enumerate(FOUR_ROWS)) + "Tr: 1 2 3\n"
NAMELESS = "\n".join(FOUR_ROWS)


@pytest.mark.parametrize("text", [NAMED, NAMELESS], ids=["named", "nameless"])
@pytest.mark.parametrize(
    ("left", "right", "baseline"), [("image_0", "image_1", 0.12), ("image_2", "image_3", 0.2)]
)
def test_folders_choose_their_rows(
    folder: Path, text: str, left: str, right: str, baseline: float
) -> None:
    (folder / "image_l").rename(folder / left)
    (folder / "image_r").rename(folder / right)
    (folder / "calib.txt").write_text(text)
    stereo = open_kitti(folder).rig.stereo
    assert stereo is not None
    assert stereo.baseline == pytest.approx(baseline)


def test_two_rows_are_the_one_pair_there_is(folder: Path) -> None:
    (folder / "image_l").rename(folder / "image_2")
    (folder / "image_r").rename(folder / "image_3")
    (folder / "calib.txt").write_text("\n".join(FOUR_ROWS[:2]))
    stereo = open_kitti(folder).rig.stereo
    assert stereo is not None
    assert stereo.baseline == pytest.approx(0.12)


def test_poses_are_moved_from_camera_0_to_the_left_camera(folder: Path) -> None:
    """A colour camera beside camera 0 moves on another course when the car turns."""
    (folder / "image_l").rename(folder / "image_2")
    (folder / "image_r").rename(folder / "image_3")
    (folder / "calib.txt").write_text(NAMED)
    found = open_kitti(folder).poses
    assert found is not None
    # P2 = K [I | t] with t = (3 / 50, 0, 0): p_2 = p_0 + t.
    T_0_2 = transform(np.eye(3), [-0.06, 0, 0])
    expected = np.linalg.inv(T_0_2) @ camera_poses() @ T_0_2
    np.testing.assert_allclose(found, expected, atol=1e-9)


Damage = Callable[[Path], object]


def rewrite(name: str, edit: Callable[[list[str]], list[str]]) -> Damage:
    def damage(folder: Path) -> None:
        lines = (folder / name).read_text().splitlines()
        (folder / name).write_text("\n".join(edit(lines)))

    return damage


def small_image(folder: Path) -> None:
    cv2.imwrite(str(folder / "image_r/000003.png"), np.zeros((HEIGHT, WIDTH - 2), np.uint8))


def remove_frame(folder: Path) -> None:
    for side in ("image_l", "image_r"):
        (folder / side / "000002.png").unlink()


def keep_one_image(folder: Path) -> None:
    for path in sorted((folder / "image_l").iterdir())[1:]:
        path.unlink()


def empty(folder: Path) -> None:
    for path in (folder / "image_l").iterdir():
        path.unlink()


MISSING: list[tuple[Damage, str]] = [
    (lambda f: (f / "image_l").rename(f / "left"), r"log holds no folder of left images; expected"),
    (lambda f: (f / "image_r").rename(f / "right"), r"image_r is missing, the right images of"),
    (lambda f: (f / "calib.txt").unlink(), r"calib.txt is missing"),
    (empty, r"image_l holds no PNG image"),
    (
        lambda f: (f / "image_r/000004.png").unlink(),
        r"image_r/000004.png is missing, but",
    ),
    (
        lambda f: (f / "image_l/000004.png").unlink(),
        r"image_l/000004.png is missing, but",
    ),
    (remove_frame, r"image_l/000002.png is missing between its neighbours"),
]


@pytest.mark.parametrize(("damage", "words"), MISSING)
def test_what_is_missing_is_named(folder: Path, damage: Damage, words: str) -> None:
    damage(folder)
    with pytest.raises(FileNotFoundError, match=words):
        open_kitti(folder)


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere is missing or is not a folder"):
        open_kitti(tmp_path / "nowhere")


WRONG: list[tuple[Damage, str]] = [
    (small_image, r"image_r/000003.png is 46 x 40 px, but the first image is 48 x 40 px"),
    (lambda f: (f / "image_l/000001.png").write_text("GIF"), r"000001.png is not a PNG image"),
    (keep_one_image, r"image_l holds a single image; a recording needs two frames"),
    (rewrite("calib.txt", lambda rows: rows[:1]), r"calib.txt:1: the file ends without .* P1"),
    (rewrite("calib.txt", lambda rows: [rows[0], "P1: 1 2"]), r"calib.txt:2: expected 12 numbers"),
    (rewrite("calib.txt", lambda rows: [rows[0], "P1: " + "x " * 12]), r"calib.txt:2: expected 12"),
    (
        rewrite("calib.txt", lambda rows: ["P0:" + rows[1][3:], "P1:" + rows[0][3:]]),
        r"calib.txt:2: the baseline .* are the left and the right row swapped\?",
    ),
    (
        rewrite("calib.txt", lambda rows: [rows[0], "P1: " + kitti_row(51, -6)]),
        r"calib.txt:2: not rectified with .*calib.txt:1",
    ),
    (
        rewrite("calib.txt", lambda rows: ["P0: 1 2 3 4 5 6 7 8 9 10 11 12", rows[1]]),
        r"calib.txt:1: not the projection of a rectified camera",
    ),
    (rewrite("poses.txt", lambda rows: rows[:-1]), r"poses.txt:4: .* 4 poses, but .* 5 images"),
    (rewrite("poses.txt", lambda rows: rows + rows[:1]), r"poses.txt:6: .* 6 poses, but"),
    (rewrite("poses.txt", lambda rows: [*rows[:4], "1 2 3"]), r"poses.txt:5: expected 12 numbers"),
    (rewrite("times.txt", lambda rows: rows[:3]), r"times.txt:3: .* 3 times, but .* 5 images"),
    (rewrite("times.txt", lambda rows: rows[::-1]), r"times.txt:2: the time does not grow"),
]


@pytest.mark.parametrize(("damage", "words"), WRONG)
def test_what_is_wrong_is_named(folder: Path, damage: Damage, words: str) -> None:
    damage(folder)
    with pytest.raises(ValueError, match=words):
        open_kitti(folder)


def test_a_damaged_image_is_refused_when_it_is_decoded(folder: Path) -> None:
    path = folder / "image_l/000002.png"
    path.write_bytes(path.read_bytes()[:30])
    recording = open_kitti(folder)
    with pytest.raises(ValueError, match=r"000002.png cannot be decoded as an image"):
        recording.image(recording.left[2], color=False)


def test_without_stamps_the_frames_are_a_step_apart(tmp_path: Path) -> None:
    write_kitti_recording(tmp_path, Rig(dt=0.25, stereo=STEREO), images(0), images(1))
    recording = open_kitti(tmp_path)
    assert recording.rig.dt == pytest.approx(0.25)
    np.testing.assert_allclose(recording.stamps, 0.25 * np.arange(N), atol=1e-9)


def test_a_recording_of_unequal_parts_is_not_written(tmp_path: Path) -> None:
    rig = Rig(dt=0.1, stereo=STEREO)
    with pytest.raises(ValueError, match=r"5 of left, 4 of right, 5 of stamps"):
        write_kitti_recording(tmp_path, rig, images(0), images(1)[:-1])
    with pytest.raises(ValueError, match=r"one of each a frame, but got .* 2 of poses"):
        write_kitti_recording(tmp_path, rig, images(0), images(1), poses=camera_poses()[:2])
    assert not list(tmp_path.iterdir())


def test_an_image_that_cannot_be_written_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "image_l" / "000003.png").mkdir(parents=True)
    with pytest.raises(OSError, match=r"image_l/000003.png cannot be written"):
        write_kitti_recording(tmp_path, Rig(dt=0.1, stereo=STEREO), images(0), images(1))


def test_a_rig_without_cameras_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"needs a rig with a stereo pair; this one has none"):
        write_kitti_recording(tmp_path, Rig(dt=0.1), images(0), images(1))
