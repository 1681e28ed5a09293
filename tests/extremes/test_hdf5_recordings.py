"""Waveforms in HDF5: as those of a WAV, and refused where the file is odd or hostile."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
from scipy.io import wavfile

from sonarsynth.description.file_formats import hdf5_files
from sonarsynth.sources.noise_source import NoiseRecording
from sonarsynth.sources.recordings import RecordingError, read_recording
from sonarsynth.sources.snap_models import RecordedSnap

RATE = 500_000
TIME = (np.arange(400) - 120) / RATE
PULSE = ((1 - (TIME / 8e-6) ** 2) * np.exp(-0.5 * (TIME / 8e-6) ** 2)).astype(np.float32)


@pytest.fixture
def file(tmp_path):
    """Two channels in a group that says the rate, and something that is no number."""
    path = tmp_path / "snap.h5"
    with h5py.File(path, "w") as made:
        made.create_group("deployment").attrs["sample_rate"] = RATE
        made["deployment"].create_dataset("pressure", data=np.stack([0 * PULSE, PULSE]), chunks=(1, 100), compression=4)
        made["deployment"]["place"] = "the reef"
    return path


def refused(path, said, **fields):
    with pytest.raises(RecordingError) as error:
        read_recording(RecordedSnap(path=str(path), **fields))
    assert said in str(error.value) and str(path) in str(error.value) and "\n" not in str(error.value)


def test_a_channel_is_as_in_a_wav(file, tmp_path):
    wavfile.write(tmp_path / "snap.wav", RATE, PULSE)
    wav = read_recording(RecordedSnap(path=str(tmp_path / "snap.wav"), distance=2.0))
    for named in (None, "/deployment/pressure", "deployment/pressure"):
        ours = read_recording(RecordedSnap(path=str(file), channel=1, dataset=named, distance=2.0))
        assert np.array_equal(ours.pressure, wav.pressure)
        assert (ours.sampling_frequency, ours.zero) == (wav.sampling_frequency, wav.zero)


def test_noise_is_played_as_from_a_wav(file, tmp_path):
    wavfile.write(tmp_path / "snap.wav", RATE, PULSE)
    sounds = [NoiseRecording(path=str(tmp_path / "snap.wav")), NoiseRecording(path=str(file), channel=1)]
    first, second = (sound.segment(1e-4, 1.7e-6, 300) for sound in sounds)
    assert np.array_equal(first, second) and first.any()


def test_whole_numbers_have_the_scale_that_the_file_says(tmp_path):
    path = tmp_path / "counts.hdf5"
    with h5py.File(path, "w") as made:
        made["counts"] = np.round(1e4 * PULSE).astype(np.int16)
        made["counts"].attrs["scale_factor"] = 1e-4
    found = read_recording(RecordedSnap(path=str(path), sampling_frequency=RATE))
    np.testing.assert_allclose(found.pressure, PULSE, atol=5.1e-5)
    refused(path, "has no attribute sampling_frequency: give the sampling_frequency")


def test_what_is_asked_for_must_be_there(file):
    refused(file, "has no channel 2, only 2", channel=2)
    refused(file, "has no dataset of numbers 'x', only 'deployment/pressure'", dataset="x")
    refused(file, "has its own sampling frequency, 500000 Hz", sampling_frequency=1e6)
    refused(file, "is silent")
    with h5py.File(file, "a") as made:
        made["second"] = PULSE
    refused(file, "has 2 datasets of numbers: name the `dataset` ('deployment/pressure', 'second')")


def external(made, folder):
    made["there"] = h5py.ExternalLink(str(folder / "other.h5"), "/pressure")


def deep_external(made, folder):
    made.create_group("a/b")["there"] = h5py.ExternalLink(str(folder / "other.h5"), "/pressure")


def raw(made, folder):
    made.create_dataset("x", (400,), "f4", external=[(str(folder / "other.raw"), 0, 1600)])


def virtual(made, folder):
    layout = h5py.VirtualLayout((400,), "f4")
    layout[:] = h5py.VirtualSource(str(folder / "other.h5"), "pressure", (400,))
    made.create_virtual_dataset("x", layout)


def huge(made, folder):
    made.create_dataset("x", (1 << 50,), "f8", chunks=(1 << 16,)).attrs["fs"] = RATE


def wide(made, folder):
    made.create_dataset("x", (400,), "f4", maxshape=(None,), chunks=(1 << 28,)).attrs["fs"] = RATE


def words(made, folder):
    made["x"] = np.array([b"a"] * 400)


def empty(made, folder):
    made["x"] = h5py.Empty("f4")


def cube(made, folder):
    made["x"] = np.zeros((10, 10, 10))


def soft(made, folder):
    made["x"] = h5py.SoftLink("/nowhere")


@pytest.mark.parametrize(
    ("forge", "said"),
    [
        (external, "'there' lies in another file, which is not read"),
        (deep_external, "'there' lies in another file, which is not read"),
        (raw, "'x' lies in another file, which is not read"),
        (virtual, "'x' lies in another file, which is not read"),
        (huge, "'/x' has 1125899906842624 numbers, more than"),
        (wide, "'/x' has 268435456 numbers in a piece, more than"),
        (words, "has 0 datasets of numbers"),
        (empty, "has 0 datasets of numbers"),
        (cube, "has the shape (10, 10, 10), and is no waveform"),
        (soft, "has 0 datasets of numbers"),
    ],
)
def test_hostile_files_are_refused_in_one_line(tmp_path, forge, said):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as made:
        forge(made, tmp_path)
    refused(path, said)


def test_many_names_of_one_dataset_are_counted(file, monkeypatch):
    monkeypatch.setattr(hdf5_files, "MOST_ITEMS", 20)
    with h5py.File(file, "a") as made:
        for number in range(20):
            made[f"again{number}"] = made["deployment/pressure"]
    refused(file, "has more than 20 groups and datasets")


def test_a_long_recording_whose_header_was_never_finished_is_taken_as_far_as_it_goes(tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, RATE, PULSE)
    whole, data = NoiseRecording(path=str(path)).segment(0.0, 1.0 / RATE, 300), bytearray(path.read_bytes())
    at = data.index(b"data") + 4
    size = (4 * len(PULSE) + 4000).to_bytes(4, "little")
    data[at : at + 4], data[4:8] = size, (len(data) + 4000).to_bytes(4, "little")
    path.write_bytes(data)
    assert np.array_equal(NoiseRecording(path=str(path)).segment(0.0, 1.0 / RATE, 300), whole)
    refused(path, "cannot be read as WAV")


def test_damaged_files_are_refused_or_read(file, tmp_path):
    data, random = file.read_bytes(), np.random.default_rng(1)
    path = tmp_path / "b.h5"
    read = 0
    for _ in range(150):
        changed = bytearray(data)
        for at in random.integers(8, len(data), int(random.integers(1, 6))):
            changed[at] = random.integers(256)
        path.write_bytes(bytes(changed)[: None if random.random() < 0.7 else int(random.integers(9, len(data)))])
        try:
            read_recording(RecordedSnap(path=str(path), channel=1, fade=0.1))
            read += 1
        except RecordingError as error:
            assert "\n" not in str(error)
    assert 10 < read < 150
