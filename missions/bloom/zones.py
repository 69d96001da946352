"""The two zones of the experiment, X-ray and Yankee: corners in local metres (gcid.md 10)."""

XRAY = "-321.4,-204.8:-50.3,-76.3:99.6,-392.6:-192.9,-521.1"
YANKEE = "114.3,-27.4:383.4,101.1:535.3,-214.4:242.8,-343.7"
STORM_REGION = "-1000,500:1000,500:1000,-1000:-1000,-1000"
