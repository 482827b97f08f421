"""Settings of industrial cameras, over the GenICam standard's own library and a camera's description of itself."""

import pytest

from tests.support.industrial import missing
from touchline.core.errors import BadInput, NotFound
from touchline.sources.industrial.camera import set_up
from touchline.sources.industrial.features import FEATURES, controls_of, write_control

try:
    from genicam.genapi import NodeMap

    from tests.support.genapi_nodes import GenApiNodes
except ImportError:
    NodeMap = None


def number(name: str, value, low, high, unit="", kind="Float", more="") -> str:
    return (
        f'<{kind} Name="{name}"><Value>{value}</Value><Min>{low}</Min><Max>{high}</Max>'
        f"{more}{f'<Unit>{unit}</Unit>' * bool(unit)}</{kind}>"
    )


def choice(name: str, entries: str, more="") -> str:
    listed = "".join(
        f'<EnumEntry Name="{entry}"><Value>{i}</Value></EnumEntry>'
        for i, entry in enumerate(entries.split())
    )
    return f'<Enumeration Name="{name}">{listed}{more or "<Value>0</Value>"}</Enumeration>'


def swiss_knife(name: str, formula: str, **variables: str) -> str:
    named = "".join(
        f'<pVariable Name="{key}">{node}</pVariable>' for key, node in variables.items()
    )
    return f'<IntSwissKnife Name="{name}">{named}<Formula>{formula}</Formula></IntSwissKnife>'


# As a colour camera with auto modes describes itself: exposure locked while it is automatic, white balance by selector,
# the rate only once it is enabled.
NEW = "".join(
    (
        swiss_knife("ExposureLocked", "A &lt;&gt; 0", A="ExposureAutoValue"),
        '<Integer Name="ExposureAutoValue"><Value>2</Value></Integer>',
        choice("ExposureAuto", "Off Once Continuous", "<pValue>ExposureAutoValue</pValue>"),
        '<Float Name="ExposureTime"><pIsLocked>ExposureLocked</pIsLocked><Value>5000</Value><Min>20</Min><Max>1e6</Max>'
        "<Unit>us</Unit></Float>",
        choice("GainAuto", "Off Continuous"),
        number("Gain", 1.5, 0, 24, "dB"),
        choice("BalanceWhiteAuto", "Off Once"),
        '<Integer Name="BalanceIndex"><Value>0</Value></Integer>',
        choice("BalanceRatioSelector", "Red Green Blue", "<pValue>BalanceIndex</pValue>"),
        '<Float Name="BalanceRatio"><pValue>RatioNow</pValue><Min>0.5</Min><Max>4</Max></Float>',
        '<Converter Name="RatioNow"><FormulaTo>FROM*1000</FormulaTo><FormulaFrom>TO/1000.0</FormulaFrom>'
        "<pValue>RatioRaw</pValue></Converter>",
        '<Integer Name="RatioRaw"><pIndex>BalanceIndex</pIndex>'
        '<pValueIndexed Index="0">RatioRed</pValueIndexed><pValueIndexed Index="2">RatioBlue</pValueIndexed>'
        "<pValueDefault>RatioGreen</pValueDefault></Integer>",
        *(
            f'<Integer Name="Ratio{colour}"><Value>{value}</Value></Integer>'
            for colour, value in (("Red", 1800), ("Green", 1000), ("Blue", 2200))
        ),
        number("Width", 1280, 64, 1936, kind="Integer", more="<Inc>16</Inc>"),
        number("Height", 1024, 64, 1216, kind="Integer", more="<Inc>2</Inc>"),
        swiss_knife("RateLocked", "E = 0", E="RateOn"),
        '<Integer Name="RateOn"><Value>0</Value></Integer>',
        '<Boolean Name="AcquisitionFrameRateEnable"><pValue>RateOn</pValue><OnValue>1</OnValue><OffValue>0</OffValue>'
        "</Boolean>",
        '<Float Name="AcquisitionFrameRate"><pIsLocked>RateLocked</pIsLocked><Value>30</Value>'
        "<Min>1</Min><Max>165</Max><Unit>Hz</Unit></Float>",
        choice("PixelFormat", "Mono12 Mono8 BayerRG8"),
        choice("AcquisitionMode", "SingleFrame Continuous"),
        '<Integer Name="TriggerIndex"><Value>0</Value></Integer>',
        choice("TriggerSelector", "FrameStart AcquisitionStart", "<pValue>TriggerIndex</pValue>"),
        '<Integer Name="TriggerRaw"><pIndex>TriggerIndex</pIndex><pValueIndexed Index="0">TriggerA</pValueIndexed>'
        "<pValueDefault>TriggerB</pValueDefault></Integer>",
        *(f'<Integer Name="Trigger{which}"><Value>1</Value></Integer>' for which in "AB"),
        choice("TriggerMode", "Off On", "<pValue>TriggerRaw</pValue>"),
    )
)
# As one made before the convention's second edition: older names, whole numbers, no unit, no auto.
OLD = "".join(
    (
        number("ExposureTimeAbs", 700, 10, 10000),
        number("GainRaw", 3, 0, 10, kind="Integer"),
        '<Float Name="AcquisitionFrameRateAbs"><Value>25</Value></Float>',
        '<Integer Name="Width"><ImposedAccessMode>RO</ImposedAccessMode><Value>640</Value></Integer>',
    )
)


def nodes(features: str):
    if NodeMap is None:
        missing("genicam", "pip install genicam")
    node_map = NodeMap()
    node_map.load_xml_from_string(
        '<?xml version="1.0" encoding="utf-8"?><RegisterDescription ModelName="Camera" VendorName="Maker" ToolTip=""'
        ' StandardNameSpace="None" SchemaMajorVersion="1" SchemaMinorVersion="1" SchemaSubMinorVersion="0"'
        ' MajorVersion="1" MinorVersion="0" SubMinorVersion="0" ProductGuid="76543210-3210-3210-3210-ba9876543210"'
        ' VersionGuid="76543210-3210-3210-3210-ba9876543210"'
        ' xmlns="http://www.genicam.org/GenApi/Version_1_1" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"'
        ' xsi:schemaLocation="http://www.genicam.org/GenApi/Version_1_1 GenApiSchema.xsd">'
        f'<Category Name="Root"></Category>{features}<Port Name="Device"></Port></RegisterDescription>'
    )
    return GenApiNodes(node_map)


@pytest.fixture
def camera():
    return nodes(NEW)


def of(controls) -> dict:
    return {control.name: control for control in controls}


def test_everything_that_can_be_set_is_listed_as_the_camera_has_it(camera):
    has = of(controls_of(camera))
    assert set(has) == set(FEATURES)
    exposure = has["exposure"]
    assert (exposure.value, exposure.unit, exposure.range, exposure.automatic) == (
        5000,
        "µs",
        (20, 1e6),
        True,
    )
    assert (has["gain"].unit, has["gain"].automatic, has["gain"].kind) == ("dB", False, "float")
    assert has["white_balance_red"].value == 1.8 and has["white_balance_blue"].value == 2.2
    # it knows "once" only, and that is no mode to be in
    assert has["white_balance_red"].automatic is None
    assert (has["width"].kind, has["width"].value, has["width"].range) == ("int", 1280, (64, 1936))
    assert has["frame_rate"].unit == "Hz"


def test_the_older_names_of_the_convention_count_as_well():
    has = of(controls_of(nodes(OLD)))
    assert (
        has["exposure"].value == 700
        and has["exposure"].automatic is None
        and has["exposure"].unit == "µs"
    )
    assert has["gain"].kind == "int"
    assert has["frame_rate"].range is None  # it names no bounds, which is not a range of 1e308


def test_a_value_is_read_back_after_it_was_set(camera):
    assert write_control(camera, "gain", 6).value == 6.0
    assert of(controls_of(camera))["gain"].value == 6.0


def test_a_value_by_hand_ends_the_automatic_and_auto_begins_it(camera):
    assert write_control(camera, "exposure", 2500) == of(controls_of(camera))["exposure"]
    assert of(controls_of(camera))["exposure"].automatic is False
    again = write_control(camera, "exposure", "auto")
    assert again.automatic is True and again.value == 2500


def test_each_colour_of_the_white_balance_is_its_own(camera):
    write_control(camera, "white_balance_red", 1.25)
    has = of(controls_of(camera))
    assert has["white_balance_red"].value == 1.25 and has["white_balance_blue"].value == 2.2


def test_a_frame_rate_is_enabled_by_setting_it(camera):
    assert write_control(camera, "frame_rate", 60).value == 60


def test_a_size_between_the_cameras_steps_goes_to_the_nearest(camera):
    assert write_control(camera, "width", 1000).value == 64 + 58 * 16  # 992
    assert write_control(camera, "width", 1936).value == 1936
    assert write_control(camera, "height", 1215.4).value == 1216


def test_the_nearest_step_is_never_beyond_the_largest_size():
    camera = nodes(number("Width", 1280, 64, 1930, kind="Integer", more="<Inc>16</Inc>"))
    # 1920; the next would be 1936
    assert write_control(camera, "width", 1929).value == 64 + 116 * 16


@pytest.mark.parametrize(
    "value",
    [float("nan"), float("inf"), -1, 1e9, 10**400, True, None, "5000", [5000], {}, "AUTO"],
    ids=lambda value: repr(value)[:12],
)
@pytest.mark.parametrize("name", ["exposure", "width"])
def test_a_value_that_it_cannot_have_is_refused_with_the_range(camera, name, value):
    before = controls_of(camera)
    with pytest.raises(BadInput, match="cannot be") as refused:
        write_control(camera, name, value)
    assert refused.value.reason == "bad-control" and (
        "20 to 1000000" in refused.value.fix or "64 to 1936" in refused.value.fix
    )
    assert controls_of(camera) == before


def test_auto_is_refused_where_there_is_no_such_mode(camera):
    with pytest.raises(BadInput, match="auto"):
        write_control(camera, "width", "auto")
    with pytest.raises(BadInput, match="auto"):
        write_control(camera, "white_balance_red", "auto")


def test_what_the_camera_itself_refuses_is_told_in_its_words():
    with pytest.raises(BadInput, match="refuses Width = 320") as refused:
        write_control(nodes(OLD), "width", 320)
    assert "writable" in refused.value.fix and refused.value.reason == "bad-control"


@pytest.mark.parametrize("name", ["colour", "", "white_balance_red", "ExposureTime"])
def test_a_setting_that_it_lacks_is_named_with_those_it_has(name):
    with pytest.raises(NotFound) as refused:
        write_control(nodes(OLD), name, 1)
    assert refused.value.reason == "unknown-control" and "exposure, gain" in refused.value.fix


def test_a_camera_without_settings_has_none():
    assert controls_of(nodes("")) == ()


def test_a_camera_that_waits_for_a_trigger_is_set_to_run(camera):
    set_up(camera, {"pixel_format": None, "fps": None})
    assert camera.get("AcquisitionMode").value == "Continuous"
    assert [camera.get(f"Trigger{which}").value for which in "AB"] == [0, 0]
    assert camera.get("PixelFormat").value == "BayerRG8"  # the best of those that we read


def test_a_format_that_we_read_is_left_as_it_is(camera):
    camera.set("PixelFormat", "Mono8")
    set_up(camera, {"pixel_format": None, "fps": 12.5})
    assert (
        camera.get("PixelFormat").value == "Mono8"
        and camera.get("AcquisitionFrameRate").value == 12.5
    )


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"pixel_format": "RGB8", "fps": None}, "Mono8, BayerRG8"),
        ({"pixel_format": None, "fps": 200.0}, "1 to 165"),
    ],
)
def test_an_address_that_asks_for_what_it_cannot_do_is_refused(camera, options, text):
    with pytest.raises(BadInput) as refused:
        set_up(camera, options)
    assert refused.value.reason == "bad-option" and text in refused.value.fix
