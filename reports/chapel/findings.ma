//Maya ASCII 2018 scene
//Codeset: UTF-8
requires maya "2018";
currentUnit -l centimeter -a degree -t film;
createNode transform -n "clerestory_findings";
createNode transform -n "D1_texture_recoloured" -p "clerestory_findings";
	addAttr -ci true -sn "note" -ln "note" -dt "string";
	addAttr -ci true -sn "nts" -ln "notes" -dt "string";
	setAttr ".t" -type "double3" 14.472301 2.513075 -0.00487 ;
	setAttr -k on ".note" -type "string" "the structure fits but the colour does not on “painting_mandorla”, 1.6 m across; not sure, because as much is off elsewhere in these pictures";
	setAttr ".nts" -type "string" "the structure fits but the colour does not on “painting_mandorla”, 1.6 m across; not sure, because as much is off elsewhere in these pictures";
createNode locator -n "D1_texture_recolouredShape" -p "D1_texture_recoloured";
	setAttr ".los" -type "double3" 0.790882 0.790882 0.790882 ;
// End of findings.ma
